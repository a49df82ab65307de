import pytest
import torch

from dnf_pyg.mesh import geometry
from dnf_pyg.mesh.noise import GaussianNoise, GaussianNormalNoise, ImpulsiveNoise, UniformNoise


def draw(noise, mesh, level=0.2, seed=0):
    pos, face = mesh
    moved = noise(pos, face, level, torch.Generator().manual_seed(seed))
    return (moved - pos) / geometry.mean_edge_length(pos, face)


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
    with pytest.raises(ValueError, match=r"Expected 'share' in \(0, 1\] \(got 0\)\. It is"):
        ImpulsiveNoise(share=0)
    for level in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="Expected 'level'"):
            GaussianNormalNoise()(*sphere_mesh, level)
