import os

import pytest
import torch
import trimesh

from dnf_pyg.errors import MeshError, MeshFileError
from dnf_pyg.mesh.io import read_mesh, write_mesh

SUFFIXES = ["obj", "ply", "stl", "off", "glb"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip_keeps_order(tmp_path, sphere_mesh, suffix):
    pos, face = sphere_mesh
    path = tmp_path / f"sphere.{suffix}"
    trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False).export(path)
    mesh = read_mesh(path)
    torch.testing.assert_close(mesh.pos[mesh.face], pos[face], rtol=0, atol=1e-6)
    assert mesh.path == path
    assert mesh.pos.dtype == torch.float64

    write_mesh(mesh, 2 * mesh.pos, tmp_path / f"larger.{suffix}")
    larger = read_mesh(tmp_path / f"larger.{suffix}")
    assert torch.equal(larger.face, mesh.face)
    torch.testing.assert_close(larger.pos, 2 * mesh.pos, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "error", "text"),
    [
        ("empty.obj", b"", MeshFileError, "0 bytes"),
        ("text.ply", b"Dear diary, nothing to see here.\n", MeshFileError, r"Expected a \.ply mesh"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", MeshError, "mesh a point cloud first"),
        ("mesh.docx", b"PK", MeshFileError, r"ending in \.obj"),
    ],
)
def test_names_the_fault_of_a_bad_file(tmp_path, name, content, error, text):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(error, match=text):
        read_mesh(tmp_path / name)


def test_missing_file(tmp_path):
    with pytest.raises(MeshFileError, match="does not exist"):
        read_mesh(tmp_path / "absent.ply")


def test_failed_write_leaves_nothing(tmp_path, monkeypatch):
    box = trimesh.creation.box()
    pos = torch.tensor(box.vertices)
    with pytest.raises(MeshFileError, match="writable folder"):
        write_mesh(box, pos, tmp_path / "absent" / "box.obj")

    def no_space(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(MeshFileError, match="No space left"):
        write_mesh(box, pos, tmp_path / "box.obj")
    assert list(tmp_path.iterdir()) == []


def test_rejects_another_number_of_positions(tmp_path):
    with pytest.raises(ValueError, match=r"'pos' with 8 vertices \(got 3\)"):
        write_mesh(trimesh.creation.box(), torch.zeros(3, 3), tmp_path / "box.obj")
