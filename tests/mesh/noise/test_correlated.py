import math

import pytest
import torch

from dnf_pyg.mesh import edges, geometry
from dnf_pyg.mesh.correlation import correlation_by_ring
from dnf_pyg.mesh.noise import CorrelatedNoise, GaussianNormalNoise, RayNoise, ScanNoise, correlated_field

SIZE = 64


def seeded(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture
def periodic_grid():
    """Faces (3, F) of a triangulated torus of 64 by 64 vertices, every one with six neighbours."""
    row, column = torch.meshgrid(torch.arange(SIZE), torch.arange(SIZE), indexing="ij")
    at = lambda down, right: ((row + down) % SIZE * SIZE + (column + right) % SIZE).flatten()  # noqa: E731
    return torch.cat([torch.stack([at(0, 0), at(0, 1), at(1, 1)]), torch.stack([at(0, 0), at(1, 1), at(1, 0)])], dim=1)


@pytest.fixture
def grid_mesh():
    """Flat square of 30 by 30 vertices with edges of length 1 and sqrt(2)."""
    row, column = torch.meshgrid(torch.arange(30), torch.arange(30), indexing="ij")
    pos = torch.stack([column, row, torch.zeros_like(row)], dim=-1).view(-1, 3).double()
    corner = (30 * row + column)[:-1, :-1].flatten()
    face = torch.cat(
        [torch.stack([corner, corner + 1, corner + 31]), torch.stack([corner, corner + 31, corner + 30])], 1
    )
    return pos, face


def spectral_correlation(steps, shifts):
    """Correlation of white noise after steps of the lazy walk on the periodic grid, from the walk's eigenvalues."""
    angle = 2 * math.pi * torch.arange(SIZE, dtype=torch.double) / SIZE
    down, right = torch.meshgrid(angle, angle, indexing="ij")
    eigenvalue = 0.5 + (torch.cos(down) + torch.cos(right) + torch.cos(down + right)) / 6
    power = eigenvalue ** (2 * steps)
    return [float((power * torch.cos(i * down + j * right)).sum() / power.sum()) for i, j in shifts]


@pytest.mark.parametrize("length", [0.0, 1.0, 2.0, 3.0])
def test_correlation_agrees_with_the_spectrum_of_the_walk(length, periodic_grid):
    (nearest,) = spectral_correlation(round(length**2), [(0, 1)])
    second = spectral_correlation(round(length**2), [(0, 2), (1, 2), (2, 1), (2, 2), (1, -1), (2, 0)])
    drawn = torch.tensor(
        [correlation_by_ring(correlated_field(periodic_grid, SIZE**2, [length], [1], seeded(i)), periodic_grid, 2)
         for i in range(12)]
    )  # fmt: skip
    assert drawn[:, 0].mean() == pytest.approx(nearest, abs=0.015)
    assert drawn[:, 1].mean() == pytest.approx(sum(second) / 6, abs=0.03)
    assert nearest == pytest.approx(math.exp(-1 / length**2) if length else 0.0, abs=0.04)


def test_shares_add_up_in_the_variance(periodic_grid):
    (long,) = spectral_correlation(16, [(0, 1)])
    drawn = [correlated_field(periodic_grid, SIZE**2, [0, 4], [1, 3], seeded(i)) for i in range(12)]
    found = torch.tensor([correlation_by_ring(field, periodic_grid, 1)[0] for field in drawn])
    assert found.mean() == pytest.approx(0.75 * long, abs=0.02)
    assert all(float(field.square().mean()) == pytest.approx(1) for field in drawn)


def test_a_field_longer_than_the_mesh_is_constant():
    field = correlated_field(torch.tensor([[0], [1], [2]]), 3, [20], [1], seeded())
    torch.testing.assert_close(field.abs(), torch.ones(3, dtype=torch.double))


def test_level_is_the_root_mean_square_along_the_normal(sphere_mesh):
    pos, face = sphere_mesh
    offset = CorrelatedNoise()(pos, face, 0.3, seeded()) - pos
    normal = geometry.vertex_normals(pos, face)
    torch.testing.assert_close(offset, (offset * normal).sum(1, keepdim=True) * normal)
    size = offset.square().sum(1).mean().sqrt() / geometry.mean_edge_length(pos, face)
    assert float(size) == pytest.approx(0.3)


def test_default_correlations_are_those_of_a_kinect(periodic_grid):
    noise = CorrelatedNoise()
    drawn = [correlated_field(periodic_grid, SIZE**2, noise.lengths, noise.shares, seeded(i)) for i in range(12)]
    found = torch.tensor([correlation_by_ring(field, periodic_grid, 4) for field in drawn]).mean(0)
    torch.testing.assert_close(found, torch.tensor([0.64, 0.44, 0.28, 0.24]), atol=0.06, rtol=0)


def test_ray_noise_moves_along_the_ray_of_each_vertex(sphere_mesh):
    pos, face = sphere_mesh
    camera = torch.tensor([0.5, 1.0, -4.0], dtype=pos.dtype)
    moved = RayNoise(camera=tuple(camera.tolist()))(pos, face, 0.3, seeded())
    assert torch.linalg.cross(moved - camera, pos - camera).norm(dim=1).max() < 1e-12
    size = (moved - pos).square().sum(1).mean().sqrt() / geometry.mean_edge_length(pos, face)
    assert float(size) == pytest.approx(0.3)


def test_ray_noise_without_a_camera_moves_all_vertices_along_one_direction(grid_mesh):
    pos, face = grid_mesh
    offset = RayNoise()(pos, face, 0.3, seeded()) - pos
    _, size, _ = torch.linalg.svd(offset)
    assert size[1] < 1e-12 * size[0]
    facing = [RayNoise()(pos, face, 0.3, seeded(i)) - pos for i in range(200)]
    slant = torch.stack([x[0].abs() / x[0].norm() for x in facing])[:, 2].arccos().rad2deg()
    assert (slant < 60).double().mean() == pytest.approx(math.sin(math.radians(60)) ** 2, abs=0.08)  # Lambert's law


def test_ray_noise_rounds_the_distance_to_the_camera(sphere_mesh):
    pos, face = sphere_mesh
    moved = RayNoise(camera=(0.0, 0.0, -4.0), step=0.4)(pos, face, 0.3, seeded())
    distance = (moved - moved.new_tensor([0.0, 0, -4])).norm(dim=1) / (0.4 * geometry.mean_edge_length(pos, face))
    torch.testing.assert_close(distance, distance.round())
    plain = RayNoise(camera=(0.0, 0.0, -4.0))(pos, face, 0.3, seeded())
    assert (moved - plain).norm(dim=1).max() <= 0.2 * geometry.mean_edge_length(pos, face) + 1e-12


def roughness(offset, face):
    start, end = edges(face)
    return float((offset[start] - offset[end]).square().sum(1).mean().sqrt())


def test_scan_noise_is_as_rough_as_white_noise(grid_mesh):
    pos, face = grid_mesh
    white = roughness(GaussianNormalNoise()(pos, face, 0.2, seeded()) - pos, face)
    drawn = [ScanNoise(ray_share=0, max_gain=50)(pos, face, 0.2, seeded(i)) - pos for i in range(20)]
    assert [roughness(offset, face) for offset in drawn] == pytest.approx([white] * 20, rel=0.06)


def test_scan_noise_covers_what_real_scans_show(grid_mesh):
    pos, face = grid_mesh
    unit = float(geometry.mean_edge_length(pos, face))
    drawn = [ScanNoise(ray_share=0)(pos, face, 0.2, seeded(i))[:, 2] for i in range(150)]
    correlation = torch.tensor([correlation_by_ring(offset, face, 3) for offset in drawn])
    level = torch.stack([offset.square().mean().sqrt() for offset in drawn]) / unit
    assert level.min() > 0.2
    assert level.max() <= 0.6 + 1e-9
    for real in ([0.64, 0.44, 0.28], [0.82, 0.64, 0.48], [0.92, 0.85, 0.79], [0.88, 0.78, 0.67]):
        assert (correlation - torch.tensor(real)).abs().amax(1).min() < 0.06


def test_scan_noise_draws_directions_and_steps_in_the_shares_asked_for(grid_mesh):
    pos, face = grid_mesh
    drawn = [ScanNoise(ray_share=0.4)(pos, face, 0.2, seeded(i)) - pos for i in range(300)]
    along_ray = torch.tensor([bool((offset[:, :2] != 0).any()) for offset in drawn])
    assert along_ray.double().mean() == pytest.approx(0.4, abs=0.08)
    assert all((torch.linalg.svdvals(offset)[1] < 1e-10).all() for offset in drawn[:20])


@pytest.mark.parametrize("kind", [CorrelatedNoise, RayNoise])
def test_rejects_bad_lengths_and_shares(kind):
    for lengths in ([], [-1.0], [math.inf]):
        with pytest.raises(ValueError, match=r"Expected 'lengths' of at least 0 edges \(got"):
            kind(lengths, [1.0])
    for shares in ([1.0, 1.0], [0.0], [-1.0]):
        with pytest.raises(ValueError, match=r"Expected 'shares' with a number of at least 0 for each of 1 lengths"):
            kind([2.0], shares)


def test_rejects_bad_steps():
    with pytest.raises(ValueError, match=r"Expected 'step' of at least 0 mean edge lengths \(got -1\)"):
        RayNoise(step=-1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"white": (0.0, 0.1)}, "Expected 'white' as two positive numbers, the smaller one first"),
        ({"short": (3.0, 1.0)}, "Expected 'short' as two positive numbers, the smaller one first"),
        ({"long": (1.0, math.inf)}, "Expected 'long' as two positive numbers, the smaller one first"),
        ({"white": (0.5, 1.5)}, "Expected 'white' and 'ray_share' of at most 1"),
        ({"ray_share": 2.0}, "Expected 'white' and 'ray_share' of at most 1"),
        ({"max_gain": 0.5}, r"Expected 'max_gain' of at least 1 \(got 0.5\)"),
    ],
)
def test_scan_noise_rejects_bad_ranges(arguments, message):
    with pytest.raises(ValueError, match=message):
        ScanNoise(**arguments)
