"""Make what ``configs/second_network.yaml`` trains on: noisy versions of clean meshes, and the weights to start from.

``python docs/examples/second_network.py data/best data/noisy single runs/start`` adds noise to every mesh of
``data/best``, and writes the weights of a second network that does what the first one, ``single``, does: what it sees
in addition has small random weights.
"""

import sys
from pathlib import Path
from zlib import crc32

import torch
import trimesh
from torch import Tensor

from dnf_pyg import load_network
from dnf_pyg.datasets.pairing import list_meshes
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import MixedNoise
from dnf_pyg.nn import SurfaceDNFNet
from dnf_pyg.synthetic.shapes.dice import Dice

NOISE = MixedNoise({"gaussian": 7, "isotropic": 2, "uniform": 1, "impulsive": 1})
LEVELS = 0.03, 0.45


def add_noise(clean: Path, pairs: Path) -> None:
    """Write a noisy and a clean version of each mesh."""
    pairs.mkdir(parents=True, exist_ok=True)
    for path in list_meshes(clean):
        mesh, dice = read_mesh(path), Dice(torch.Generator().manual_seed(crc32(path.stem.encode()) + 7))
        noisy = NOISE(mesh.pos, mesh.face, dice.uniform(*LEVELS), dice.generator)
        for pos, name in ((mesh.pos, path.stem), (noisy, f"{path.stem}_noisy")):
            write_mesh(trimesh.Trimesh(pos.numpy(), mesh.face.t().numpy(), process=False), pos, pairs / f"{name}.ply")


def widen(first: str, start: Path, num_earlier: int = 2) -> None:
    """Write the weights of a network that sees further normals, with small weights for them."""
    net = load_network(first)
    wider = SurfaceDNFNet(**{**net.arguments, "num_earlier": num_earlier})
    state = net.state_dict()
    for name, value in wider.state_dict().items():
        state[name] = _widened(state[name], value.shape, 3 * num_earlier)
    wider.load_state_dict(state)
    wider.save_pretrained(start)


def _widened(value: Tensor, shape: torch.Size, added: int) -> Tensor:
    """Put random columns after the 4 of normal and area wherever these appear, and random rows at the end."""
    if value.shape == shape:
        return value
    random = 0.02 * torch.randn(shape, generator=torch.Generator().manual_seed(0))
    if value.dim() == 1 or value.size(1) == shape[1]:  # of a head
        random[: len(value)] = value
        return random
    kept = torch.ones(shape[1], dtype=torch.bool)
    kept[4 : 4 + added] = False
    if shape[1] - value.size(1) == 2 * added:  # its own features and their differences to the neighbours'
        kept[8 + added : 8 + 2 * added] = False
    random[:, kept] = value
    return random


if __name__ == "__main__":
    add_noise(Path(sys.argv[1]), Path(sys.argv[2]))
    widen(sys.argv[3], Path(sys.argv[4]))
