import math

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.geometry import (
    angular_difference,
    edge_lengths,
    edges,
    face_normals,
    mean_edge_length,
    vertex_normals,
)
from dnf_pyg.mesh.local_noise import LocalNoise
from dnf_pyg.mesh.noise import CorrelatedNoise, ImpulsiveNoise
from dnf_pyg.mesh.noise_level import estimate_noise


def as_tensors(mesh):
    return torch.tensor(mesh.vertices, dtype=torch.float64), torch.tensor(mesh.faces).t().contiguous()


def noisy(pos, face, sigma):
    """Gaussian noise along the vertex normals, of a standard deviation for all or for each vertex, model units."""
    noise = torch.randn(len(pos), 1, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    return pos + torch.as_tensor(sigma).view(-1, 1) * noise * vertex_normals(pos, face)


@pytest.fixture(scope="module")
def torus():
    return as_tensors(trimesh.creation.torus(2, 0.7, 96, 48))


def relative(found, sigma):
    """Quantiles of the ratio of standard deviations, in percent of the vertices."""
    return (found / sigma).quantile(torch.tensor([0.05, 0.5, 0.95], dtype=found.dtype)).tolist()


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_finds_the_noise_that_was_added(torus, share):
    sigma = share * mean_edge_length(*torus)
    low, middle, high = relative(LocalNoise(noisy(*torus, sigma), torus[1]).sigma, sigma)
    assert middle == pytest.approx(1, abs=0.1)
    assert (low > 0.75, high < 1.3) == (True, True)


def test_finds_noise_that_grows_across_the_mesh(torus):
    pos, face = torus
    along = (pos[:, 0] - pos[:, 0].min()) / (pos[:, 0].max() - pos[:, 0].min())
    sigma = (0.05 + 0.25 * along) * mean_edge_length(pos, face)
    low, middle, high = relative(LocalNoise(noisy(pos, face, sigma), face).sigma, sigma)
    assert middle == pytest.approx(1, abs=0.1)
    assert (low > 0.7, high < 1.4) == (True, True)


@pytest.mark.parametrize("level", [0.02, 0.1])
def test_sharp_edges_do_not_count(level, cube_mesh):
    pos, face = cube_mesh
    fine = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False).subdivide()
    sigma = level * mean_edge_length(*as_tensors(fine))
    found = LocalNoise(noisy(*as_tensors(fine), sigma), as_tensors(fine)[1])
    assert relative(found.sigma, sigma)[1] == pytest.approx(1, abs=0.15)
    assert found.certain.all()


def test_impulsive_noise_between_flat_pairs(cube_mesh):
    """A quarter of the pairs of faces stays exactly flat, and that is no sign of edges."""
    fine = as_tensors(
        trimesh.Trimesh(cube_mesh[0].numpy(), cube_mesh[1].t().numpy(), process=False).subdivide().subdivide()
    )
    bumpy = ImpulsiveNoise()(*fine, 0.3, torch.Generator().manual_seed(0))
    found = LocalNoise(bumpy, fine[1])
    assert relative(found.sigma, (bumpy - fine[0]).square().sum(dim=1).mean().sqrt())[1] == pytest.approx(1, abs=0.15)
    assert found.unexplained(face_normals(*fine), 1.6).double().mean() < 0.1


def test_mesh_with_two_scales(sphere_mesh):
    small, face = as_tensors(trimesh.creation.icosphere(subdivisions=4))
    pos, faces = torch.cat([small, 8 * small + 20]), torch.cat([face, face + len(small)], dim=1)
    sigma = 0.2 * mean_edge_length(small, face) * torch.tensor([1.0, 8.0]).repeat_interleave(len(small))
    low, middle, high = relative(LocalNoise(noisy(pos, faces, sigma), faces).sigma, sigma)
    assert (low > 0.75, middle == pytest.approx(1, abs=0.1), high < 1.3) == (True, True, True)


def test_correlated_noise_counts_as_of_its_level(torus):
    pos, face = torus
    bumpy = CorrelatedNoise([0, 2, 8], [0.1, 0.6, 0.3])(pos, face, 0.4, torch.Generator().manual_seed(0))
    estimate, found = estimate_noise(bumpy, face), LocalNoise(bumpy, face)
    assert found.estimate == estimate
    assert estimate.correlation > 0.5
    assert found.sigma.min() >= 0.999 * estimate.level * mean_edge_length(bumpy, face)


def test_tilt_is_that_of_noisy_faces(torus):
    pos, face = torus
    sigma = 0.05 * float(mean_edge_length(pos, face))
    found = LocalNoise(noisy(pos, face, sigma), face).tilt()
    angle = angular_difference(face_normals(noisy(pos, face, sigma), face), face_normals(pos, face)).double()
    assert (angle / found).square().mean().sqrt() == pytest.approx(1, abs=0.1)
    assert (angle / found).mean() == pytest.approx(0.886, abs=0.1)


def test_trust_is_the_ratio_of_variances(torus):
    pos, face = torus
    sigma = 0.005 * float(mean_edge_length(pos, face))
    found = LocalNoise(noisy(pos, face, sigma), face)
    for number in (0, 700, 4000):
        corner = noisy(pos, face, sigma)[face[:, number]]
        reach = sum((point - corner.mean(dim=0)).dot(point - corner.mean(dim=0)) for point in corner) / 3
        variance = sum(float(found.sigma[vertex]) ** 2 for vertex in face[:, number]) / 3
        assert float(found.trust()[number]) == pytest.approx(variance / (0.02**2 * float(reach)), rel=1e-6)
        assert found.trust()[number] < 1


def test_trust_in_long_triangles_only_is_limited(torus):
    assert (LocalNoise(noisy(*torus, 0.1 * mean_edge_length(*torus)), torus[1]).trust() == 1).all()
    pos, face = as_tensors(trimesh.creation.cylinder(5, 100, sections=64))
    bumpy = pos + 0.05 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    trust, side = LocalNoise(bumpy, face).trust(), face_normals(pos, face)[:, 2].abs() < 0.5
    assert trust[side].max() < 4e-3  # as (0.05 / (0.02 * 50)) ** 2, and some more
    assert trust[~side].min() > 0.1


def test_excess_tells_removed_noise_from_changed_shape(cube_mesh):
    pos, face = as_tensors(trimesh.Trimesh(cube_mesh[0].numpy(), cube_mesh[1].t().numpy(), process=False).subdivide())
    noise = LocalNoise(noisy(pos, face, 0.05 * mean_edge_length(pos, face)), face)
    clean = face_normals(pos, face)
    assert noise.excess(clean).quantile(0.99) < 1.4
    top = clean[:, 2] > 0.9
    bent = torch.where(top[:, None], torch.nn.functional.normalize(clean + torch.tensor([0.5, 0, 0])), clean)
    inside = (pos[:, 2] > 0.999) & (pos[:, :2].abs() < 0.8).all(dim=1)
    assert noise.excess(bent)[inside].min() > 2
    assert noise.excess(bent)[pos[:, 2] < -0.5].max() < 2


def test_a_limit_keeps_what_is_not_explained(cube_mesh):
    pos, face = as_tensors(trimesh.Trimesh(cube_mesh[0].numpy(), cube_mesh[1].t().numpy(), process=False).subdivide())
    noise = LocalNoise(noisy(pos, face, 0.05 * mean_edge_length(pos, face)), face)
    clean = face_normals(pos, face)
    assert not noise.unexplained(clean, 1.6).any()
    assert noise.unexplained(-clean, 1.6).all()
    assert not noise.unexplained(-clean, math.inf).any()


CLEAN = {
    "box": trimesh.creation.box((100, 100, 1)),
    "box stored as float32": trimesh.Trimesh(
        np.float64(np.float32(trimesh.creation.cylinder(5, 100, sections=64).vertices + 0.123)),
        trimesh.creation.cylinder(5, 100, sections=64).faces,
        process=False,
    ),
    "sphere of 80 faces": trimesh.creation.icosphere(subdivisions=1),
    "sphere of 5120 faces": trimesh.creation.icosphere(subdivisions=4),
    "torus": trimesh.creation.torus(10, 3, 32, 16),
    "capsule": trimesh.creation.capsule(10, 3, count=[8, 8]),
}


@pytest.mark.parametrize("name", CLEAN)
def test_clean_mesh_has_no_certain_noise(name):
    assert not LocalNoise(*as_tensors(CLEAN[name])).certain.any()


def test_needs_more_noise_on_fewer_vertices():
    for subdivisions, level, certain in ((1, 0.3, False), (2, 0.02, False), (2, 0.1, True), (4, 0.05, True)):
        pos, face = as_tensors(trimesh.creation.icosphere(subdivisions=subdivisions))
        sigma = level * edge_lengths(pos, edges(face)).min()
        assert LocalNoise(noisy(pos, face, sigma), face).certain.all() == certain, (subdivisions, level)


def test_pieces_of_a_mesh_count_by_themselves(sphere_mesh):
    large, small = as_tensors(trimesh.creation.icosphere(subdivisions=4)), as_tensors(trimesh.creation.box())
    pos = torch.cat([noisy(*large, 0.1 * mean_edge_length(*large)), small[0] + 5, torch.zeros(1, 3)])
    found = LocalNoise(pos, torch.cat([large[1], small[1] + len(large[0])], dim=1))
    assert found.certain[: len(large[0])].all()
    assert not found.certain[len(large[0]) :].any()


def test_fine_detail_of_a_clean_mesh_needs_to_look_like_strong_noise():
    pos, face = as_tensors(trimesh.creation.icosphere(subdivisions=4))
    detail = pos[:, 2] > 0.85  # less than a quarter of the mesh
    for share, certain in ((0.03, False), (0.15, True)):
        sigma = torch.where(detail, share * edge_lengths(pos, edges(face)).min(), 0.0)
        found = LocalNoise(noisy(pos, face, sigma), face)
        assert found.estimate.is_negligible
        assert found.certain[pos[:, 2] > 0.95].any() == certain
        assert not found.certain[pos[:, 2] < 0].any()


def test_degenerate_meshes():
    for pos, face in (
        (torch.zeros(3, 3), torch.tensor([[0], [1], [2]])),
        (torch.eye(3), torch.tensor([[0], [0], [0]])),
        (torch.eye(3), torch.tensor([[0, 0], [1, 1], [2, 2]])),
    ):
        noise = LocalNoise(pos, face)
        assert not noise.certain.any()
        assert noise.excess(torch.ones(face.size(1), 3)).isinf().all()


def test_turns_with_the_mesh(torus):
    pos = noisy(*torus, 0.1 * mean_edge_length(*torus))
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=pos.dtype))[0]
    found, turned = LocalNoise(pos, torus[1]), LocalNoise(10 * pos @ turn + 1000, torus[1])
    torch.testing.assert_close(turned.sigma, 10 * found.sigma, rtol=1e-6, atol=0)
