"""Make the folder of clean meshes that ``configs/single.yaml`` trains on.

``python docs/examples/best_meshes.py data/cnr/Synthetic/train/original data/best`` links the meshes whose licence
allows redistribution, adds two coarser versions of each with the irregular triangles of quadric decimation, bent
versions and versions with a fine relief of these, and makes shapes of every kind in code. Half an hour; files that
exist are kept.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from zlib import crc32

import fast_simplification
import torch
import trimesh

from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.geometry import mean_edge_length, vertex_normals
from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.synthetic.shapes.dice import Dice

REDISTRIBUTABLE = """
Cylinder ccylinder Icosahedron Octahedron octa-flower cad gear hexnut stepped_shaft lbracket tee_pipe hex_cone
housing gem twist_prism steps_ramp boat blob torus_knot twisted_torus terrain spot penguin fish airplane koala
scorpion skull boot
""".split()  # noqa: SIM905 - a text of names reads better than quotes around each
KINDS = SHAPES.keys() - {"coarse"}  # noise turns its needles by any angle
SEEDS = range(1, 19)
BENDS = range(1, 4)


def add_given(source: Path, names: Iterable[str], folder: Path) -> None:
    """Link meshes, and decimate each to a share of its faces between 35% and 64% that its name decides."""
    for name in names:
        link = folder / f"{name}.obj"
        if not link.exists():
            link.symlink_to((source / f"{name}.obj").resolve())
        mesh = read_mesh(link)
        chance = crc32(name.encode()) % 30
        for version, share in (("coarse", 0.35 + chance / 100), ("coarser", 0.14 + chance / 300)):
            path = folder / f"{name}-{version}.ply"
            if not path.exists():
                vertices, faces = fast_simplification.simplify(
                    mesh.pos.float().numpy(), mesh.face.t().int().numpy(), target_reduction=1 - share
                )
                _write(trimesh.Trimesh(vertices, faces, process=False), path)


def add_bent(names: Iterable[str], seeds: Iterable[int], folder: Path) -> None:
    """Bend and stretch each mesh and its coarse version smoothly, at random."""
    for seed in seeds:
        for name in names:
            for version in ("", "-coarse"):
                path = folder / f"{name}{version}-bent-{seed}.ply"
                if path.exists():
                    continue
                mesh = read_mesh(next(folder.glob(f"{name}{version}.*")))
                dice = Dice(torch.Generator().manual_seed(seed * 1009 + crc32(path.stem.encode()) % 1000))
                pos = mesh.pos - mesh.pos.mean(dim=0)
                size = pos.norm(dim=1).max()
                stretch = torch.tensor([dice.uniform(-0.35, 0.35) for _ in range(3)], dtype=torch.float64).exp()
                pos = (pos / size) @ dice.rotation() * stretch
                wave = torch.stack([dice.direction() * dice.uniform(1.0, 3.0) for _ in range(6)], dim=1)
                bend = torch.sin(pos @ wave + 6.3 * torch.rand(6, generator=dice.generator)) @ dice.normal(6, 3)
                pos = pos + 0.07 * bend
                _write(trimesh.Trimesh(pos.numpy(), mesh.face.t().numpy(), process=False), path)


def add_relief(names: Iterable[str], folder: Path) -> None:
    """Cover each mesh with a relief of waves 5 to 14 edges long."""
    for name in names:
        path = folder / f"{name}-relief.ply"
        if path.exists():
            continue
        mesh = read_mesh(folder / f"{name}.obj")
        dice = Dice(torch.Generator().manual_seed(crc32(path.stem.encode())))
        edge = mean_edge_length(mesh.pos, mesh.face)
        length = dice.uniform(5, 14)
        wave = torch.stack([dice.direction() * dice.uniform(0.8, 1.25) * 6.28 / length for _ in range(10)], dim=1)
        height = torch.sin(mesh.pos / edge @ wave + 6.3 * torch.rand(10, generator=dice.generator)).sum(dim=1)
        height = dice.uniform(0.009, 0.02) * length * edge * height[:, None]
        pos = mesh.pos + height * vertex_normals(mesh.pos, mesh.face)
        _write(trimesh.Trimesh(pos.numpy(), mesh.face.t().numpy(), process=False), path)


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
    add_bent(REDISTRIBUTABLE, BENDS, folder)
    add_relief(REDISTRIBUTABLE, folder)
    add_shapes(sorted(KINDS), SEEDS, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
