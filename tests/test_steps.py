import math
from dataclasses import replace

import pytest
import torch
import trimesh

from dnf_pyg import FilterOptions, UpdateOptions, denoise
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.filtering import filter_normals
from dnf_pyg.mesh import Topology, face_normals, filled_face_normals
from dnf_pyg.mesh.coarse import coarsen
from dnf_pyg.mesh.noise import CorrelatedNoise
from dnf_pyg.mesh.noise_level import NoiseEstimate
from dnf_pyg.mesh.normal_smoothing import smooth_normals
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.nn import Cascade, DNFNet, SurfaceDNFNet
from dnf_pyg.progress import Stopwatch
from dnf_pyg.steps import Steps

SMALL = {"k": (3, 5), "residual_k": 4, "channels": (8, 8), "embedding_channels": 8}
FILTERING = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, num_coarser=0)
UPDATE = UpdateOptions(num_iterations=4, early_stopping="never", max_excess=float("inf"))


@pytest.fixture
def noisy():
    torch.manual_seed(0)
    sphere = trimesh.creation.icosphere(subdivisions=3)
    pos = torch.tensor(sphere.vertices) + 0.01 * torch.randn(sphere.vertices.shape, dtype=torch.double)
    return pos, torch.tensor(sphere.faces).t().contiguous()


def updated(pos, face, normal, **options):
    return update_vertices(pos, face, normal.double(), 4, **options)


def test_networks_of_a_cascade_see_the_mesh_and_the_normals_of_those_before(noisy):
    pos, face = noisy
    first, second = SurfaceDNFNet(**SMALL).eval(), SurfaceDNFNet(**SMALL, num_earlier=2).eval()
    result = denoise((pos, face.t()), Cascade([first, second]), filtering=FILTERING, update=UPDATE)
    one = filter_normals(first, pos, face, FILTERING).normal.double()
    between = updated(pos, face, one)
    earlier = torch.stack([one, filled_face_normals(pos, face)], dim=1)
    options = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, seed=1)
    two = filter_normals(second, between, face, options, earlier=earlier).normal
    torch.testing.assert_close(result.normal, two, rtol=0, atol=1e-6)
    torch.testing.assert_close(result.pos, updated(pos, face, two), rtol=0, atol=1e-6)


def test_later_updates_of_a_cascade_run_a_quarter_longer(noisy):
    pos, face = noisy
    networks = [SurfaceDNFNet(**SMALL).eval(), *(SurfaceDNFNet(**SMALL, num_earlier=2).eval() for _ in range(2))]
    told = []
    update = UpdateOptions(num_iterations=40, early_stopping="always", max_excess=float("inf"))
    steps = Steps(
        Cascade(networks), FILTERING, update, NoiseEstimate(0.2, 0.0), 2, lambda done, total: None, Stopwatch(),
        ended=lambda count, why: told.append((count, why)),
    )  # fmt: skip
    steps(pos, face, torch.zeros(len(pos), dtype=torch.bool), Topology(face, len(pos)))
    assert len(told) == 6
    for (first, why), second, third in (told[:3], told[3:]):
        assert 3 <= first < 32
        assert why == "the estimated error began to rise"
        assert second == third == (math.ceil(1.25 * first), "1.25 times as many as for the first network")


def test_normals_of_later_networks_are_smoothed_less(noisy):
    pos, face = noisy
    first, second = SurfaceDNFNet(**SMALL).eval(), SurfaceDNFNet(**SMALL, num_earlier=2).eval()
    topology, options = Topology(face, len(pos)), replace(FILTERING, smoothing=None)
    steps = Steps(
        Cascade([first, second]), options, UPDATE, NoiseEstimate(0.2, 0.0), 1, lambda done, total: None, Stopwatch(),
        ended=lambda count, why: None,
    )  # fmt: skip
    _, fused = steps(pos, face, torch.zeros(len(pos), dtype=torch.bool), topology)
    tolerance = 0.2 * math.degrees(2.0 * 0.2)
    one = filter_normals(first, pos, face, options).normal.double()
    one = smooth_normals(one, pos, topology, tolerance, 0.4 * tolerance)
    between, earlier = updated(pos, face, one), torch.stack([one, filled_face_normals(pos, face)], dim=1)
    two = filter_normals(second, between, face, replace(options, seed=1), earlier=earlier).normal.double()
    less, full = (smooth_normals(two, between, topology, *2 * [t]) for t in (0.25 * tolerance, tolerance))
    torch.testing.assert_close(fused.normal, less.float(), rtol=0, atol=1e-6)
    assert not torch.allclose(less, full, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("network", "given", "correlation", "share"),
    [
        (SurfaceDNFNet, None, 0.0, 0.2),
        (SurfaceDNFNet, None, 0.8, 0.05),
        (SurfaceDNFNet, 0.1, 0.0, 0.1),
        (SurfaceDNFNet, 0.2, 0.8, 0.2),
        (DNFNet, None, 0.0, 0.5),
        (DNFNet, None, 0.8, 0.125),
    ],
)
def test_normals_are_smoothed_as_suits_the_network_and_the_noise_or_as_told(noisy, network, given, correlation, share):
    pos, face = noisy
    topology, net = Topology(face, len(pos)), network(**SMALL).eval()
    options, noise = replace(FILTERING, smoothing=given), NoiseEstimate(0.2, correlation)
    steps = Steps(net, options, UPDATE, noise, 1, lambda done, total: None, Stopwatch(), lambda count, why: None)
    moved, fused = steps(pos, face, torch.zeros(len(pos), dtype=torch.bool), topology)
    normal = filter_normals(net, pos, face, options).normal.double()
    tolerance = math.degrees(share * 2 * 0.2)
    normal = smooth_normals(normal, pos, topology, tolerance, 0.4 * tolerance)
    torch.testing.assert_close(fused.normal, normal.float(), rtol=0, atol=1e-5)
    torch.testing.assert_close(moved, updated(pos, face, normal), rtol=0, atol=1e-5)


def test_the_mesh_starts_from_what_its_coarser_version_became(noisy):
    pos, face = noisy
    net = SurfaceDNFNet(**SMALL).eval()
    options = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, num_coarser=1)
    result = denoise((pos, face.t()), net, filtering=options, update=UPDATE)
    coarse = coarsen(pos, face, 0.16)
    moved = updated(coarse.pos, coarse.face, filter_normals(net, coarse.pos, coarse.face, FILTERING).normal)
    start = pos + coarse.prolong(moved - coarse.pos)
    normal = filter_normals(net, start, face, FILTERING).normal
    torch.testing.assert_close(result.normal, normal, rtol=0, atol=1e-5)
    torch.testing.assert_close(result.pos, updated(start, face, normal, origin=pos), rtol=0, atol=1e-5)


@pytest.mark.parametrize("strength", [1.0, 0.5])
def test_no_vertex_moves_further_than_allowed(noisy, strength):
    pos, face = noisy
    options = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, num_coarser=1)
    update = UpdateOptions(max_move=0.05, strength=strength, early_stopping="never", max_excess=float("inf"))
    result = denoise((pos, face.t()), SurfaceDNFNet(**SMALL).eval(), filtering=options, update=update)
    assert 0.01 < float(result.movement.max()) <= 0.05 * (1 + 1e-9)


def test_vertices_that_may_not_move_stay_through_all_versions(noisy):
    pos, face = noisy
    mask = torch.arange(len(pos)) % 3 > 0
    options = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, num_coarser=1)
    result = denoise((pos, face.t()), SurfaceDNFNet(**SMALL).eval(), filtering=options, update=UPDATE, mask=mask)
    assert torch.equal(result.pos[~mask], pos[~mask])
    assert not torch.equal(result.pos[mask], pos[mask])


def test_correlated_noise_is_found_and_a_coarser_version_helps():
    mesh = trimesh.creation.icosphere(subdivisions=4)
    pos, face = torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()
    noise = CorrelatedNoise([0, 2], [0.2, 0.8])(pos, face, 0.4, torch.Generator().manual_seed(0))
    found = denoise((noise, face.t()))
    assert found.noise.is_correlated
    assert "coarsen" in found.seconds
    flat = denoise((noise, face.t()), filtering=FilterOptions(num_coarser=0))
    clean = face_normals(pos, face)
    one, other = (mean_angular_difference(face_normals(result.pos, face), clean) for result in (found, flat))
    assert one < 0.9 * other


POINTS = torch.rand(1500, 3, generator=torch.Generator().manual_seed(0), dtype=torch.double)
ROW = torch.arange(1400)
WITHOUT_SHAPE = {
    "faces of one vertex": (POINTS, ROW[:, None].expand(-1, 3)),
    "needles, of which none is left on a coarser version": (POINTS, torch.stack([ROW, ROW + 1, ROW + 1], dim=1)),
    "one point": (torch.ones_like(POINTS), torch.stack([ROW, ROW + 1, ROW + 2], dim=1)),
}


@pytest.mark.parametrize("name", WITHOUT_SHAPE)
def test_mesh_without_a_shape_takes_a_coarser_version(name):
    pos, face = WITHOUT_SHAPE[name]
    net = SurfaceDNFNet(**SMALL).eval()
    options = FilterOptions(patch_size=100, precision="fp32", smoothing=0.0, num_coarser=1)
    result = denoise((pos, face), net, filtering=options, update=UPDATE)
    assert result.pos.isfinite().all()
    assert result.normal.isfinite().all()
    if not name.startswith("needles"):
        torch.testing.assert_close(result.pos, pos, rtol=0, atol=1e-12)
