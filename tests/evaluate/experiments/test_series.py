import pytest
import torch
import trimesh

from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.experiments import SERIES
from dnf_pyg.evaluate.experiments.series import split_faces
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import geometry


@pytest.fixture
def ball(tmp_path):
    trimesh.creation.icosphere(subdivisions=4).export(tmp_path / "ball.ply")
    return tmp_path / "ball.ply"


def moved(item):
    clean, noisy = read_mesh(item.clean), read_mesh(item.noisy)
    assert torch.equal(clean.face, noisy.face)
    offset = (noisy.pos - clean.pos).norm(dim=1)
    return float(offset.square().mean().sqrt() / geometry.mean_edge_length(clean.pos, clean.face))


def test_noise_levels_are_those_asked_for(ball, tmp_path):
    items = SERIES["noise-levels"].prepare([ball], ["0.1", "0.7"], tmp_path / "out")
    assert [moved(item) for item in items] == pytest.approx([0.1, 0.7], rel=0.05)  # 2562 samples


def test_noise_kinds(ball, tmp_path):
    one, two = SERIES["noise-kinds"].prepare([ball], ["uniform", "impulsive"], tmp_path / "out")
    assert moved(one) == pytest.approx(0.2 / 3**0.5, rel=0.05)
    still = (read_mesh(two.noisy).pos == read_mesh(two.clean).pos).all(dim=1).double().mean()
    assert still == pytest.approx(0.7, abs=0.04)


def test_resolutions_halve_the_faces_and_keep_the_shape(ball, tmp_path):
    items = SERIES["resolution"].prepare([ball], ["1", "4", "16"], tmp_path / "out")
    faces = [read_mesh(item.clean).face.size(1) for item in items]
    assert faces == pytest.approx([5120, 1280, 320], rel=0.02)
    for item in items:
        assert (read_mesh(item.clean).pos.norm(dim=1) - 1).abs().max() < 0.05
        assert moved(item) == pytest.approx(0.1, rel=0.15)


def test_split_faces_lie_on_the_surface_and_make_slivers(sphere_mesh):
    pos, face = sphere_mesh
    new_pos, new_face = split_faces(pos, face, 0.5, torch.Generator().manual_seed(0))
    added = len(new_pos) - len(pos)
    assert new_face.size(1) == face.size(1) + 2 * added
    assert added == pytest.approx(0.5 * face.size(1), rel=0.15)
    assert geometry.face_areas(new_pos, new_face).sum() == pytest.approx(geometry.face_areas(pos, face).sum())
    mesh = trimesh.Trimesh(new_pos.numpy(), new_face.t().numpy(), process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False).volume)


def test_meshes_repeat_and_are_made_again_when_their_source_changes(ball, tmp_path):
    series = SERIES["noise-levels"]
    item = series.prepare([ball], ["0.3"], tmp_path / "out")[0]
    before, time = item.noisy.read_bytes(), item.noisy.stat().st_mtime_ns
    assert series.prepare([ball], ["0.3"], tmp_path / "out")[0].noisy.stat().st_mtime_ns == time
    assert series.prepare([ball], ["0.3"], tmp_path / "other")[0].noisy.read_bytes() == before
    trimesh.creation.box().export(ball)
    assert read_mesh(series.prepare([ball], ["0.3"], tmp_path / "out")[0].noisy).face.size(1) == 12


def test_unknown_setting(ball, tmp_path):
    with pytest.raises(DataError, match=r"from 0, 0.25, 0.5, 1 \(got '2'\)\. Choose"):
        SERIES["triangulation"].prepare([ball], ["2"], tmp_path)
