"""Make the folder of clean meshes that ``configs/best.yaml`` trains on.

``python docs/examples/best_meshes.py data/cnr/Synthetic/train/original data/best`` links the meshes whose licence
allows redistribution, adds a coarser version of each with the irregular triangles of quadric decimation, and makes
three shapes of every kind in code. Ten minutes; what is there already is left as it is.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from zlib import crc32

import fast_simplification
import torch
import trimesh

from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.synthetic.shapes import SHAPES

REDISTRIBUTABLE = """
Cylinder ccylinder Icosahedron Octahedron octa-flower cad gear hexnut stepped_shaft lbracket tee_pipe hex_cone
housing gem twist_prism steps_ramp boat blob torus_knot twisted_torus terrain spot penguin fish airplane koala
scorpion skull boot
""".split()  # noqa: SIM905 - a text of names reads better than quotes around each
SEEDS = (1, 2, 3)


def add_given(source: Path, names: Iterable[str], folder: Path) -> None:
    """Link meshes, and decimate each to a share of its faces between 35% and 64% that its name decides."""
    for name in names:
        link, coarse = folder / f"{name}.obj", folder / f"{name}-coarse.ply"
        if not link.exists():
            link.symlink_to((source / f"{name}.obj").resolve())
        if not coarse.exists():
            mesh = read_mesh(link)
            share = 0.35 + crc32(name.encode()) % 30 / 100
            vertices, faces = fast_simplification.simplify(
                mesh.pos.float().numpy(), mesh.face.t().int().numpy(), target_reduction=1 - share
            )
            _write(trimesh.Trimesh(vertices, faces, process=False), coarse)


def add_shapes(kinds: Iterable[str], seeds: Iterable[int], folder: Path) -> None:
    """Make shapes of 6,000 to 15,000 faces in code."""
    for seed in seeds:
        for kind in kinds:
            path = folder / f"{kind}-{seed}.ply"
            if not path.exists():
                num_faces = 6000 + (seed * 7919 + crc32(kind.encode())) % 10 * 1000
                pos, face = SHAPES[kind](torch.Generator().manual_seed(seed), num_faces)
                _write(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), path)


def _write(mesh: trimesh.Trimesh, path: Path) -> None:
    write_mesh(mesh, torch.from_numpy(mesh.vertices.copy()), path)


def main(source: Path, folder: Path) -> None:
    """Make everything."""
    folder.mkdir(parents=True, exist_ok=True)
    add_given(source, REDISTRIBUTABLE, folder)
    add_shapes(SHAPES, SEEDS, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
