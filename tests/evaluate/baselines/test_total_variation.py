import math

import pytest
import torch

from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.baselines import TotalVariationFilter
from dnf_pyg.mesh.geometry import angular_difference, face_areas, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.mesh.vertex_update import update_vertices


def noisy(mesh, level=0.2):
    pos, face = mesh
    return GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(0))


def roof(angle):
    """Two equal faces, their normals at ``angle`` (radians) on either side of the z axis."""
    rise = -math.sin(angle)
    run = math.cos(angle)
    pos = torch.tensor([[0, -0.5, 0], [0, 0.5, 0], [-run, 0, rise], [run, 0, rise]], dtype=torch.float64)
    return pos, torch.tensor([[0, 1], [1, 0], [2, 3]])


def loop(pos, face, alpha, penalty, num_iterations):
    """The method with a dense matrix, edge by edge."""
    corners = [set(f) for f in face.t().tolist()]
    num_faces = len(corners)
    edges = [(i, j) for j in range(num_faces) for i in range(j) if len(corners[i] & corners[j]) == 2]
    ends = [[*(corners[i] & corners[j])] for i, j in edges]
    length = torch.stack([(pos[a] - pos[b]).norm() for a, b in ends])
    length, area = length / length.mean(), face_areas(pos, face) / face_areas(pos, face).mean()
    system = torch.diag(alpha * area)
    for (i, j), weight in zip(edges, length, strict=True):
        for row, column, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            system[row, column] += sign * penalty * weight
    start = normal = face_normals(pos, face)
    difference, multiplier = (torch.zeros(len(edges), 3, dtype=pos.dtype) for _ in range(2))
    for _ in range(num_iterations):
        right = alpha * area[:, None] * start
        for e, (i, j) in enumerate(edges):
            flow = length[e] * (penalty * difference[e] - multiplier[e])
            right[i] += flow
            right[j] -= flow
        normal = torch.nn.functional.normalize(torch.linalg.solve(system, right))
        for e, (i, j) in enumerate(edges):
            across = normal[i] - normal[j]
            target = across + multiplier[e] / penalty
            excess = float(target.norm()) - math.exp(-(float(across.norm()) ** 4)) / penalty
            difference[e] = target * max(excess, 0) / target.norm()
            multiplier[e] += penalty * (across - difference[e])
    return normal


def test_equals_a_loop_over_edges(sphere_mesh):
    pos, face = noisy(sphere_mesh), sphere_mesh[1]
    result = TotalVariationFilter(fidelity=2.0, penalty=0.7, num_iterations=5, num_vertex_iterations=4)(pos, face)
    torch.testing.assert_close(result.normal, loop(pos, face, 2.0, 0.7, 5))
    torch.testing.assert_close(result.pos, update_vertices(pos, face, result.normal, 4))


@pytest.mark.parametrize("fidelity", [3.0, 6.0])
def test_finds_the_minimum_for_two_faces(fidelity):
    angle = math.radians(30)
    normal = TotalVariationFilter(fidelity, penalty=0.01, num_iterations=4000)(*roof(angle)).normal
    found = math.atan2(abs(float(normal[0, 0])), float(normal[0, 2]))
    weight = math.exp(-((2 * math.sin(found)) ** 4))
    # derivative of weight * 2 sin(x) + fidelity * |n(x) - n(angle)|^2 by the angle x to the z axis
    assert fidelity * math.sin(angle - found) == pytest.approx(weight * math.cos(found), rel=0.01)
    torch.testing.assert_close(normal[0], normal[1] * torch.tensor([-1.0, 1, 1]).double())


def test_a_small_bend_becomes_flat():
    normal = TotalVariationFilter(fidelity=1.0)(*roof(math.radians(20))).normal
    torch.testing.assert_close(normal, torch.tensor([[0.0, 0, 1], [0, 0, 1]]).double(), atol=1e-3, rtol=0)


def test_denoises_a_cube_and_keeps_its_edges(cube_mesh):
    clean, face = cube_mesh
    pos = noisy(cube_mesh)
    after = angular_difference(face_normals(TotalVariationFilter()(pos, face).pos, face), face_normals(clean, face))
    assert after.mean() < 3


def test_does_not_depend_on_units(cube_mesh):
    pos, face = noisy(cube_mesh), cube_mesh[1]
    torch.testing.assert_close(
        TotalVariationFilter()(1000 * pos, face).normal, TotalVariationFilter()(pos, face).normal
    )


def test_keeps_dtype_and_input(cube_mesh):
    pos, face = noisy(cube_mesh).float(), cube_mesh[1]
    before = pos.clone()
    result = TotalVariationFilter(num_iterations=1)(pos, face)
    assert result.pos.dtype == result.normal.dtype == torch.float32
    assert torch.equal(pos, before)


def test_lone_and_zero_area_faces_keep_a_finite_normal():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9], [9, 9, 8], [9, 8, 9]])
    face = torch.tensor([[0, 0, 4], [1, 1, 5], [2, 3, 6]])  # a face, a face without area beside it, a lone face
    result = TotalVariationFilter()(pos, face)
    torch.testing.assert_close(result.normal.norm(dim=-1), torch.ones(3))
    torch.testing.assert_close(result.normal[2], face_normals(pos, face)[2])
    assert result.pos.isfinite().all()
    alone = face[:, 2:]
    torch.testing.assert_close(TotalVariationFilter()(pos, alone).normal, face_normals(pos, alone))


def test_mesh_without_faces():
    with pytest.raises(MeshError, match="0 faces"):
        TotalVariationFilter()(torch.zeros(3, 3), torch.zeros(3, 0, dtype=torch.long))
