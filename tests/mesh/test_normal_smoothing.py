import math

import numpy as np
import pytest
import torch
import trimesh
from torch.nn.functional import normalize

from dnf_pyg.mesh import Topology, face_areas, face_normals
from dnf_pyg.mesh.geometry import angular_difference
from dnf_pyg.mesh.normal_smoothing import _coefficients, smooth_normals
from dnf_pyg.synthetic.shapes import SHAPES


@pytest.fixture(scope="module")
def blob():
    pos, face = SHAPES["blob"](torch.Generator().manual_seed(3), 2000)
    return pos.double(), face


def grid(size):
    """A plane of ``2 * size**2`` triangles."""
    row, column = torch.meshgrid(torch.arange(size + 1), torch.arange(size + 1), indexing="ij")
    pos = torch.stack([column.flatten(), row.flatten(), torch.zeros((size + 1) ** 2)], dim=1).double()
    corner = (row[:-1, :-1] * (size + 1) + column[:-1, :-1]).flatten()
    lower = torch.stack([corner, corner + 1, corner + size + 1])
    upper = torch.stack([corner + 1, corner + size + 2, corner + size + 1])
    return pos, torch.cat([lower, upper], dim=1)


def tilted(normal, degrees, seed=0):
    """Normals with independent errors of about so many degrees."""
    noise = torch.randn(normal.shape, generator=torch.Generator().manual_seed(seed), dtype=normal.dtype)
    return normalize(normal + math.radians(degrees) / math.sqrt(2) * noise, dim=1)


def reference(normal, pos, face, tolerance, wide_tolerance=0.0):
    """The formulas of the docstrings, face by face, with powers of matrices."""
    n, a, corner = normal.numpy(), face_areas(pos, face).numpy(), pos[face.t()].numpy()
    center = corner.mean(axis=1)
    touches = (face.t()[:, None, :, None] == face.t()[None, :, None, :]).flatten(2).any(dim=2)
    rings = [row.nonzero().flatten().tolist() for row in touches]  # with the face itself
    ringed = list(enumerate(rings))

    def unit(v):
        return v / np.linalg.norm(v, axis=-1, keepdims=True)

    def bilateral(n):
        reach = [min(max(5 * np.median([np.linalg.norm(n[f] - n[g]) for g in ring]), 0.05), 0.5) for f, ring in ringed]
        matrix = np.zeros((len(n), len(n)))
        for f, ring in ringed:
            for g in ring:
                matrix[f, g] = a[g] * math.exp(-((np.linalg.norm(n[f] - n[g]) / min(reach[f], reach[g])) ** 2))
        return matrix / matrix.sum(axis=1, keepdims=True)

    def iterated(s):
        for _ in range(8):
            s = unit(matrix @ s)
        return s

    def curved(power):
        """Filter normals without the tilts of their facets, by means that keep what varies linearly."""
        mean = unit(matrix @ unit(matrix @ n))
        tilt, fitted = np.zeros_like(n), np.zeros_like(matrix)
        for f, ring in ringed:
            axes = np.linalg.svd(mean[f][None])[2][1:]
            offset, change = (center[ring] - center[f]) @ axes.T, (mean[ring] - mean[f]) @ axes.T
            ridge = 1e-3 * matrix[f, ring] @ (offset**2).sum(axis=1)
            tilt[f] = tilt_of(corner[f] @ axes.T, shape_operator(offset, change, matrix[f, ring], ridge)) @ axes
            moments = (matrix[f, ring, None] * offset).T @ offset + ridge * np.eye(2)
            slope = np.linalg.solve(moments, matrix[f, ring] @ offset)
            fitted[f, ring] = matrix[f, ring] * np.clip(1 - offset @ slope, 0, 3)
        filtered = np.linalg.matrix_power(fitted / fitted.sum(axis=1, keepdims=True), power)
        return unit(2 * filtered @ (n - tilt) - filtered @ filtered @ (n - tilt) + tilt)

    def blended(n, s, d, limit):
        share = np.exp(-((d / min(math.radians(limit), 5 * np.median(d))) ** 2))
        return unit(n + share[:, None] * (s - n))

    def detail(s):
        d = np.linalg.norm(s - n, axis=1)
        for _ in range(2):
            d = np.array([np.average(d[ring], weights=a[ring]) for _, ring in ringed])
        return d

    matrix = bilateral(n)
    once = iterated(n)
    s = unit(2 * once - iterated(once))
    found = blended(n, s, detail(s), tolerance)
    if wide_tolerance == 0:
        return found
    for power in (16, 64):
        s = curved(power)
        found = blended(found, s, detail(s), wide_tolerance)
    matrix = bilateral(found)
    flat = np.linalg.matrix_power(matrix, 1024)
    s = unit(2 * flat @ found - flat @ (flat @ found))
    variation = [sum(matrix[f, g] * np.linalg.norm(s[f] - s[g]) for g in ring) for f, ring in ringed]
    return blended(found, s, detail(s) + 2 * np.array(variation), wide_tolerance)


def shape_operator(offset, change, weight, ridge):
    """Symmetric matrix that takes offsets to changes, by least squares; the ridge keeps its entries small."""
    u, v = offset.T
    zero, root = np.zeros_like(u), np.sqrt(weight)
    rows = np.concatenate([root[:, None] * np.stack([u, v, zero], 1), root[:, None] * np.stack([zero, u, v], 1)])
    rows = np.concatenate([rows, math.sqrt(ridge) * np.diag([1, math.sqrt(2), 1])])
    a, b, c = np.linalg.lstsq(rows, np.concatenate([root * change[:, 0], root * change[:, 1], np.zeros(3)]))[0]
    return np.array([[a, b], [b, c]])


def tilt_of(corner, shape):
    """Slope of the plane through the heights of a quadratic surface at the corners of a triangle."""
    corner = corner - corner.mean(axis=0)
    height = 0.5 * ((corner @ shape) * corner).sum(axis=1)
    slope = np.linalg.solve(np.column_stack([corner, np.ones(3)]), height)[:2]
    return slope * (0.3 / max(np.linalg.norm(slope), 0.3))


@pytest.mark.parametrize("tolerance", [1.0, 3.0])
def test_equals_the_formulas(blob, tolerance):
    pos, face = blob
    normal = tilted(face_normals(pos, face), 2.0)
    found = smooth_normals(normal, pos, Topology(face, len(pos)), tolerance)
    expected = torch.from_numpy(reference(normal, pos, face, tolerance))
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-12)


def test_errors_on_a_plane_average_out():
    pos, face = grid(20)
    clean = face_normals(pos, face)
    noisy = tilted(clean, 1.5)
    found = smooth_normals(noisy, pos, Topology(face, len(pos)), 6.0)
    assert angular_difference(found, clean).mean() < 0.4 * angular_difference(noisy, clean).mean()


def test_wide_filters_equal_the_formulas_on_a_plane():
    pos, face = grid(12)
    normal, topology = tilted(face_normals(pos, face), 1.0), Topology(face, len(pos))
    expected = torch.from_numpy(reference(normal, pos, face, 3.0, 2.0))
    assert angular_difference(expected, smooth_normals(normal, pos, topology, 3.0)).max() > 0.1
    # small coefficients are left out
    assert angular_difference(expected, smooth_normals(normal, pos, topology, 3.0, 2.0)).max() < 0.01


def test_wide_filters_equal_the_formulas_on_a_curved_surface(blob):
    pos, face = blob
    normal, topology = tilted(face_normals(pos, face), 1.0), Topology(face, len(pos))
    expected = torch.from_numpy(reference(normal, pos, face, 3.0, 3.0))
    assert angular_difference(expected, smooth_normals(normal, pos, topology, 3.0)).max() > 0.5
    differences = angular_difference(expected, smooth_normals(normal, pos, topology, 3.0, 3.0))
    assert differences.mean() < 0.01  # small coefficients are left out
    assert differences.max() < 0.1


@pytest.mark.parametrize("power", [2, 8, 1024])
def test_polynomial_is_the_filter_with_twicing(power):
    x = np.linspace(-1, 1, 2001)
    np.testing.assert_allclose(
        np.polynomial.chebyshev.chebval(x, _coefficients(power)), 2 * x**power - x ** (2 * power), atol=0.02
    )


def test_errors_alike_over_many_faces_of_a_plane_average_out():
    pos, face = grid(40)
    clean = face_normals(pos, face)
    centre = pos[face].mean(dim=0)
    wave = torch.nn.functional.pad(0.01 * torch.sin(centre[:, :2] * (math.pi / 10)), (0, 1))  # 20 edges long
    bent, topology = normalize(clean + wave, dim=1), Topology(face, len(pos))
    before = angular_difference(bent, clean).mean()
    assert angular_difference(smooth_normals(bent, pos, topology, 6.0), clean).mean() > 0.9 * before
    assert angular_difference(smooth_normals(bent, pos, topology, 6.0, 2.0), clean).mean() < 0.2 * before


def uneven_ball():
    ball = trimesh.creation.icosphere(subdivisions=4)
    return normalize(tilted(torch.tensor(ball.vertices), 1.0), dim=1), torch.tensor(ball.faces).t()


def test_wide_filters_keep_the_tilts_of_the_facets_of_a_ball():
    pos, face = uneven_ball()
    normal, topology = face_normals(pos, face), Topology(face, len(pos))
    roughness = angular_difference(normal, normalize(pos[face].mean(dim=0), dim=1)).mean()
    assert angular_difference(smooth_normals(normal, pos, topology, 4.0), normal).mean() > 0.7 * roughness
    assert angular_difference(smooth_normals(normal, pos, topology, 4.0, 4.0), normal).mean() < 0.3 * roughness


def test_errors_on_a_ball_average_out():
    pos, face = uneven_ball()
    normal, topology = face_normals(pos, face), Topology(face, len(pos))
    noisy = tilted(normal, 1.0)
    before = angular_difference(noisy, normal).mean()
    narrow, wide = (smooth_normals(noisy, pos, topology, 4.0, wide_tolerance) for wide_tolerance in (0.0, 4.0))
    assert angular_difference(wide, normal).mean() < 0.25 * before
    assert angular_difference(wide, normal).mean() < 0.4 * angular_difference(narrow, normal).mean()


def test_bumps_are_not_flattened():
    pos, face = grid(40)
    pos[:, 2] = 2 * torch.sin(pos[:, 0] / 40 * 2 * math.pi)  # a wave of 40 edges, tilted by up to 17 degrees
    normal = face_normals(pos, face)
    found = smooth_normals(normal, pos, Topology(face, len(pos)), 10.0)
    inside = ((pos[face].mean(dim=0)[:, :2] - 20).abs() < 15).all(dim=1)
    assert angular_difference(found, normal)[inside].mean() < 0.5


def test_weak_edges_of_a_flat_mesh_stay():
    pos, face = grid(20)
    pos[:, 2] = 0.05 * (pos[:, 0] - 10).abs()  # a fold of 5.7 degrees
    normal = face_normals(pos, face)
    found = smooth_normals(tilted(normal, 0.1), pos, Topology(face, len(pos)), 30.0)
    assert angular_difference(found, normal).max() < 0.5


def test_detail_above_the_tolerance_stays(blob):
    pos, face = blob
    rough = tilted(face_normals(pos, face), 25.0)
    found = smooth_normals(rough, pos, Topology(face, len(pos)), 3.0)
    assert angular_difference(found, rough).max() < 0.1


def test_sharp_edges_stay(cube_mesh):
    pos, face = cube_mesh
    normal = face_normals(pos, face)
    found = smooth_normals(normal, pos, Topology(face, len(pos)), 3.0)
    assert angular_difference(found, normal).max() < 0.01


def test_turns_with_the_mesh_and_does_not_depend_on_units(blob):
    pos, face = blob
    topology = Topology(face, len(pos))
    normal = tilted(face_normals(pos, face), 2.0)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64))[0]
    found = smooth_normals(normal @ turn, 1e-6 * pos @ turn, topology, 3.0)
    torch.testing.assert_close(found, smooth_normals(normal, pos, topology, 3.0) @ turn, rtol=0, atol=1e-9)


def test_order_of_the_faces_does_not_matter(blob):
    pos, face = blob
    normal = tilted(face_normals(pos, face), 2.0)
    order = torch.randperm(face.size(1), generator=torch.Generator().manual_seed(2))
    found = smooth_normals(normal[order], pos, Topology(face[:, order], len(pos)), 3.0)
    torch.testing.assert_close(
        found, smooth_normals(normal, pos, Topology(face, len(pos)), 3.0)[order], rtol=0, atol=1e-9
    )


def test_faces_without_an_area_have_no_weight():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    face = torch.tensor([[0, 1, 1], [1, 3, 1], [2, 2, 3]])
    normal = normalize(torch.tensor([[0.0, 0, 1], [0.02, 0, 1], [0.01, 0.02, 1]]), dim=1)
    found = smooth_normals(normal, pos, Topology(face, 4), 3.0)
    assert found[:2, 1].abs().max() == 0
    assert found[0, 0] > 0.005
    for wide_tolerance in (0.0, 3.0):
        nothing = smooth_normals(normal, torch.zeros(4, 3), Topology(face, 4), 3.0, wide_tolerance)
        torch.testing.assert_close(nothing, normal)


def test_zero_tolerance_changes_nothing(blob):
    pos, face = blob
    normal = face_normals(pos, face).float()
    assert smooth_normals(normal, pos, Topology(face, len(pos)), 0) is normal
    assert smooth_normals(normal, pos, Topology(face, len(pos)), 3.0).dtype == torch.float32


def test_no_faces_are_fine():
    found = smooth_normals(torch.empty(0, 3), torch.empty(0, 3), Topology(torch.empty(3, 0, dtype=torch.long), 0), 3.0)
    assert found.shape == (0, 3)


@pytest.mark.parametrize("tolerance", [-1.0, math.inf, math.nan])
def test_wrong_tolerances_are_refused(tolerance):
    with pytest.raises(ValueError, match=r"'tolerance' of at least 0 degrees \(got .*\). Use 0 for no smoothing"):
        smooth_normals(torch.eye(3), torch.zeros(9, 3), Topology(torch.arange(9).view(3, 3), 9), tolerance)
