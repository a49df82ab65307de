import runpy
from pathlib import Path

import pytest
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
    fine, coarse = (read_mesh(tmp_path / name) for name in ("ball.obj", "ball-coarse.ply"))
    assert fine.face.size(1) == 5120
    assert 0.35 <= coarse.face.size(1) / 5120 <= 0.65
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
