import math

import numpy as np
import pytest
import torch

from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.baselines import L0Minimization, l0_minimization
from dnf_pyg.evaluate.baselines.hinges import hinges
from dnf_pyg.evaluate.baselines.l0_minimization import edge_operator
from dnf_pyg.mesh.geometry import angular_difference, face_normals, mean_edge_length
from dnf_pyg.mesh.noise import GaussianNormalNoise


def noisy(mesh, level=0.2):
    pos, face = mesh
    return GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(0))


def bends(pos, face):
    """Angles at the edges, degrees."""
    normal = face_normals(pos, face)
    first, second = hinges(face)[0]
    return angular_difference(normal[first], normal[second])


def test_edge_operator_is_the_bend_times_the_heights():
    rng = np.random.default_rng(0)
    pos, vertex = rng.normal(size=(40, 3)), np.arange(40).reshape(10, 4).T
    found = np.einsum("ke,kei->ei", edge_operator(pos, vertex), pos[vertex])
    for value, (start, end, apex, other) in zip(found, pos[vertex].transpose(1, 0, 2), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        away = [(p - start) - ((p - start) @ along) * along for p in (apex, other)]  # from the edge to each apex
        heights = [np.linalg.norm(a) for a in away]
        bend = sum(a / h for a, h in zip(away, heights, strict=True))
        np.testing.assert_allclose(value, bend / sum(1 / h for h in heights))


def test_edge_operator_is_zero_where_flat_and_where_nothing_is():
    rng = np.random.default_rng(0)
    flat = np.concatenate([rng.normal(size=(4, 2)) * [1, 0.1] + [[0, -1], [0, 1], [3, 0], [-3, 0]], np.ones((4, 1))], 1)
    assert np.abs(edge_operator(flat, np.arange(4)[:, None]).T @ flat).max() < 1e-12
    assert not edge_operator(np.zeros((4, 3)), np.arange(4)[:, None]).any()


def loop(pos, face, strength, weights):
    """The method with dense matrices, edge by edge."""
    _, vertex = hinges(face)
    bend = math.radians(float(bends(pos, face).mean()))
    penalty = strength * float(mean_edge_length(pos, face)) ** 2 * bend
    moved, regularity = pos, 0.1 * bend
    for weight in weights:
        operator, regularizer = (torch.zeros(vertex.size(1), len(pos), dtype=pos.dtype) for _ in range(2))
        coefficient = edge_operator(moved.numpy(), vertex.numpy()).T
        for e, around in enumerate(vertex.t().tolist()):
            for v, value, sign in zip(around, coefficient[e], (1, 1, -1, -1), strict=True):
                operator[e, v] += value
                regularizer[e, v] += sign
        sparse = torch.stack([d if d.square().sum() >= penalty / weight else 0 * d for d in operator @ moved])
        system = torch.eye(len(pos)).to(pos) + regularity * regularizer.t() @ regularizer
        moved = torch.linalg.solve(system + weight * operator.t() @ operator, pos + weight * operator.t() @ sparse)
        regularity /= 2
    return moved


def test_equals_a_loop_over_edges(sphere_mesh):
    pos, face = noisy(sphere_mesh), sphere_mesh[1]
    result = L0Minimization(0.3, growth=4, first_weight=0.5, last_weight=30)(pos, face)
    torch.testing.assert_close(result.pos, loop(pos, face, 0.3, [0.5, 2, 8]), atol=1e-4, rtol=0)
    torch.testing.assert_close(result.normal, face_normals(result.pos, face))


def test_makes_the_sides_of_a_cube_flat_and_keeps_its_edges(cube_mesh):
    clean, face = cube_mesh
    pos = noisy(cube_mesh, 0.1)
    moved = L0Minimization()(pos, face).pos
    assert angular_difference(face_normals(moved, face), face_normals(clean, face)).mean() < 1
    sharp = bends(clean, face) > 80
    assert (bends(moved, face)[sharp] > 70).float().mean() > 0.95
    assert (bends(moved, face)[~sharp] < 1).float().mean() > 0.95
    assert (bends(pos, face)[~sharp] < 1).float().mean() < 0.1


def test_a_flat_mesh_stays():
    step = torch.arange(4.0).double()
    pos = torch.cartesian_prod(step, step, torch.zeros(1).double())
    corner = torch.tensor([4 * i + j for i in range(3) for j in range(3)])
    face = torch.cat(
        [torch.stack([corner, corner + 4, corner + 1]), torch.stack([corner + 1, corner + 4, corner + 5])], 1
    )
    torch.testing.assert_close(L0Minimization()(pos, face).pos, pos, atol=1e-4, rtol=0)


def test_does_not_depend_on_units_or_place(cube_mesh):
    pos, face = noisy(cube_mesh), cube_mesh[1]
    there = L0Minimization()(1000 * pos + 5000, face).pos
    torch.testing.assert_close((there - 5000) / 1000, L0Minimization()(pos, face).pos, atol=1e-4, rtol=0)


def test_keeps_dtype_and_input(cube_mesh):
    pos, face = noisy(cube_mesh).float(), cube_mesh[1]
    before = pos.clone()
    result = L0Minimization(last_weight=0.01)(pos, face)
    assert result.pos.dtype == result.normal.dtype == torch.float32
    assert torch.equal(pos, before)


def test_lone_and_zero_area_faces():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9], [9, 9, 8], [9, 8, 9]])
    face = torch.tensor([[0, 0, 4], [1, 1, 5], [2, 3, 6]])  # a face, a face without area beside it, a lone face
    result = L0Minimization()(pos, face)
    assert result.pos.isfinite().all()
    torch.testing.assert_close(result.normal.norm(dim=-1), torch.ones(3))
    torch.testing.assert_close(L0Minimization()(pos, face[:, 2:]).pos, pos)


def test_a_system_that_cannot_be_solved(cube_mesh, monkeypatch):
    monkeypatch.setattr(l0_minimization, "cg", lambda system, b, **options: (b, 1))
    with pytest.raises(MeshError, match=r"to converge \(got no solution\)"):
        L0Minimization()(*cube_mesh)


def test_mesh_without_faces():
    with pytest.raises(MeshError, match="0 faces"):
        L0Minimization()(torch.zeros(3, 3), torch.zeros(3, 0, dtype=torch.long))
