import pytest
import torch
from jsonargparse import ArgumentParser

from dnf_pyg.mesh import geometry
from dnf_pyg.mesh.noise import (
    NOISE_KINDS,
    GaussianNoise,
    GaussianNormalNoise,
    ImpulsiveNoise,
    MixedNoise,
    Noise,
    UniformNoise,
)


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


@pytest.mark.parametrize("noise", [GaussianNormalNoise(), UniformNoise(), ImpulsiveNoise()])
def test_moves_along_the_vertex_normal(noise, sphere_mesh):
    offset = draw(noise, sphere_mesh)
    normal = geometry.vertex_normals(*sphere_mesh)
    torch.testing.assert_close(offset, (offset * normal).sum(1, keepdim=True) * normal)


def test_levels_are_multiples_of_the_mean_edge_length(cube_mesh):
    assert draw(GaussianNormalNoise(), cube_mesh, 0.3).norm(dim=1).square().mean().sqrt() == pytest.approx(0.3, rel=0.1)
    assert draw(GaussianNoise(), cube_mesh, 0.3).std() == pytest.approx(0.3, rel=0.1)
    assert 0.25 < draw(UniformNoise(), cube_mesh, 0.3).norm(dim=1).max() <= 0.3 + 1e-9


def test_impulsive_noise_hits_its_share(cube_mesh):
    hit = draw(ImpulsiveNoise(share=0.25), cube_mesh).norm(dim=1) > 0
    assert hit.double().mean() == pytest.approx(0.25, abs=0.08)


def test_vertex_without_faces_stays():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]])
    moved = GaussianNormalNoise()(pos, torch.tensor([[0], [1], [2]]), 0.5, torch.Generator().manual_seed(0))
    assert torch.equal(moved[3], pos[3])


def test_rejects_bad_arguments(sphere_mesh):
    with pytest.raises(ValueError, match=r"Expected 'share' in \(0, 1\] \(got 0\)"):
        ImpulsiveNoise(share=0)
    for level in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="Expected 'level'"):
            GaussianNormalNoise()(*sphere_mesh, level)


def test_mixed_noise_draws_each_kind_as_often_as_asked():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    face = torch.tensor([[0, 0], [1, 2], [2, 3]])
    noise, generator = MixedNoise({"gaussian": 3, "isotropic": 1}), torch.Generator().manual_seed(0)
    along = [bool((noise(pos, face, 0.1, generator)[:, :2] == pos[:, :2]).all()) for _ in range(400)]
    assert sum(along) / 400 == pytest.approx(0.75, abs=0.06)


@pytest.mark.parametrize("shares", [{}, {"gaussian": 0}, {"salt": 1}])
def test_mixed_noise_refuses_other_shares(shares):
    with pytest.raises(ValueError, match=r"Expected positive 'shares' of gaussian, isotropic, uniform, impulsive"):
        MixedNoise(shares)


def test_noise_can_be_named_in_a_config_file():
    parser = ArgumentParser()
    parser.add_argument("--noise", type=Noise)
    chosen = {"class_path": "dnf_pyg.mesh.noise.MixedNoise", "init_args": {"shares": {"uniform": 1}}}
    noise = parser.instantiate(parser.parse_object({"noise": chosen})).noise
    assert isinstance(noise, MixedNoise)
    assert noise.shares == {"uniform": 1}
