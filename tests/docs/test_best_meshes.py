import runpy
from pathlib import Path

import pytest
import torch
import trimesh

from dnf_pyg.io import read_mesh

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "best_meshes.py"


@pytest.fixture
def example():
    return runpy.run_path(str(EXAMPLE))


def test_given_meshes_and_coarser_ones(example, tmp_path):
    (tmp_path / "given").mkdir()
    trimesh.creation.icosphere(subdivisions=4).export(tmp_path / "given" / "ball.obj")
    example["add_given"](tmp_path / "given", ["ball"], tmp_path)
    fine, coarse, coarser = (read_mesh(tmp_path / f"ball{end}") for end in (".obj", "-coarse.ply", "-coarser.ply"))
    assert fine.face.size(1) == 5120
    assert 0.35 <= coarse.face.size(1) / 5120 <= 0.65
    assert 0.14 <= coarser.face.size(1) / 5120 <= 0.25
    assert (coarse.pos.norm(dim=1) - 1).abs().max() < 0.02


def test_shapes_are_the_same_again_and_kept(example, tmp_path):
    example["add_shapes"](["blob"], [1, 2], tmp_path)
    first = (tmp_path / "blob-1.ply").read_bytes()
    assert first != (tmp_path / "blob-2.ply").read_bytes()
    (tmp_path / "blob-1.ply").unlink()
    (tmp_path / "blob-2.ply").write_bytes(b"kept")
    example["add_shapes"](["blob"], [1, 2], tmp_path)
    assert (tmp_path / "blob-1.ply").read_bytes() == first
    assert (tmp_path / "blob-2.ply").read_bytes() == b"kept"


def test_bent_and_relief_versions_keep_the_faces(example, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=4)
    for name in ("ball.obj", "ball-coarse.ply"):
        ball.export(tmp_path / name)
    example["add_bent"](["ball"], [1, 2], tmp_path)
    example["add_relief"](["ball"], tmp_path)
    plain = read_mesh(tmp_path / "ball.obj")
    bent = [read_mesh(tmp_path / f"ball{version}-bent-{seed}.ply") for version in ("", "-coarse") for seed in (1, 2)]
    assert all(torch.equal(mesh.face, plain.face) for mesh in bent)
    assert not torch.equal(bent[0].pos, bent[1].pos)
    relief = read_mesh(tmp_path / "ball-relief.ply").pos.norm(dim=1)
    assert 0.001 < relief.std() < 0.1
