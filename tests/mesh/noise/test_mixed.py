import pytest
import torch
from jsonargparse import ArgumentParser

from dnf_pyg.mesh import geometry
from dnf_pyg.mesh.noise import NOISE_KINDS, MixedNoise, Noise, ScanNoise


def draw(noise, mesh, level=0.2, seed=0):
    pos, face = mesh
    moved = noise(pos, face, level, torch.Generator().manual_seed(seed))
    return (moved - pos) / geometry.mean_edge_length(pos, face)


@pytest.mark.parametrize("kind", NOISE_KINDS.values())
def test_repeats_for_a_seed_and_keeps_dtype_and_input(kind, sphere_mesh):
    pos, face = sphere_mesh
    before = pos.clone()
    torch.testing.assert_close(draw(kind(), sphere_mesh), draw(kind(), sphere_mesh), rtol=0, atol=0)
    assert not torch.equal(draw(kind(), sphere_mesh), draw(kind(), sphere_mesh, seed=1))
    assert kind()(pos.float(), face, 0.1).dtype == torch.float32
    torch.testing.assert_close(pos, before, rtol=0, atol=0)
    assert torch.equal(kind()(pos, face, 0.0), pos)


@pytest.mark.parametrize("kind", NOISE_KINDS.values())
def test_vertices_without_a_face_do_not_count(kind, sphere_mesh):
    pos, face = sphere_mesh
    longer = torch.cat([pos, pos.new_full((1, 3), 1e3)])
    moved = kind()(longer, face, 0.2, torch.Generator().manual_seed(0))
    assert torch.equal(moved[-1], longer[-1]) or kind is NOISE_KINDS["isotropic"]
    assert (moved[:-1] - pos).norm(dim=1).max() < 3


def test_mixed_noise_draws_each_kind_as_often_as_asked():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    face = torch.tensor([[0, 0], [1, 2], [2, 3]])
    noise, generator = MixedNoise({"gaussian": 3, "isotropic": 1}), torch.Generator().manual_seed(0)
    along = [bool((noise(pos, face, 0.1, generator)[:, :2] == pos[:, :2]).all()) for _ in range(400)]
    assert sum(along) / 400 == pytest.approx(0.75, abs=0.06)


@pytest.mark.parametrize("shares", [{}, {"gaussian": 0}, {"salt": 1}])
def test_mixed_noise_refuses_other_shares(shares):
    with pytest.raises(ValueError, match="Expected 'shares' with positive numbers for some of gaussian, isotropic"):
        MixedNoise(shares)


def test_noise_can_be_named_in_a_config_file():
    parser = ArgumentParser()
    parser.add_argument("--noise", type=Noise)
    chosen = {"class_path": "dnf_pyg.mesh.noise.MixedNoise", "init_args": {"shares": {"uniform": 1}}}
    noise = parser.instantiate(parser.parse_object({"noise": chosen})).noise
    assert isinstance(noise, MixedNoise)
    assert noise.shares == {"uniform": 1}


def test_scan_noise_is_set_up_in_a_config_file():
    parser = ArgumentParser()
    parser.add_argument("--noise", type=Noise)
    chosen = {"class_path": "dnf_pyg.mesh.noise.ScanNoise", "init_args": {"long": [5, 20], "ray_share": 0.3}}
    noise = parser.instantiate(parser.parse_object({"noise": chosen})).noise
    assert isinstance(noise, ScanNoise)
    assert (noise.long, noise.short, noise.ray_share) == ((5.0, 20.0), (1.0, 4.0), 0.3)
