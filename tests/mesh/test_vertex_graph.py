import numpy as np
import torch

from dnf_pyg.mesh.geometry import edges
from dnf_pyg.mesh.vertex_graph import lazy_walk, vertex_adjacency, walk_differences, walk_means


def test_adjacency_marks_the_edges_once(sphere_mesh):
    pos, face = sphere_mesh
    expected = np.zeros((len(pos), len(pos)))
    for a, b, c in face.t().tolist():
        for start, end in ((a, b), (b, c), (c, a)):
            expected[start, end] = expected[end, start] = 1
    assert (vertex_adjacency(edges(face), len(pos)).toarray() == expected).all()


def test_lazy_walk_averages_with_the_neighbours(sphere_mesh):
    pos, face = sphere_mesh
    adjacency = vertex_adjacency(edges(face), len(pos)).toarray()
    expected = [(pos[i] + pos[adjacency[i] > 0].mean(0)) / 2 for i in range(len(pos))]
    torch.testing.assert_close(torch.from_numpy(lazy_walk(edges(face), len(pos)) @ pos.numpy()), torch.stack(expected))


def test_eigenvalues_of_the_walk_lie_between_0_and_1(cube_mesh):
    pos, face = cube_mesh
    values = np.linalg.eigvals(lazy_walk(edges(face), len(pos)).toarray())
    assert values.real.min() > -1e-12
    assert values.real.max() < 1 + 1e-12


def test_vertices_without_a_face_keep_their_value():
    walk = lazy_walk(edges(torch.tensor([[0, 0], [1, 1], [2, 1]])), 4)
    assert (walk @ np.array([3.0, 3, 3, 7]) == [3, 3, 3, 7]).all()


def test_means_and_differences_are_powers_of_the_walk(sphere_mesh):
    pos, face = sphere_mesh
    walk = lazy_walk(edges(face), len(pos))
    dense, values = walk.toarray(), pos.double().numpy()
    for steps in (0, 1, 5):
        power = np.linalg.matrix_power
        np.testing.assert_allclose(walk_means(walk, values, steps), power(dense, steps) @ values, atol=1e-12)
        rest = power(np.eye(len(pos)) - dense, steps)
        np.testing.assert_allclose(walk_differences(walk, values, steps), rest @ values, atol=1e-12)
