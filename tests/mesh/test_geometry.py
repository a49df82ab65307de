import math

import pytest
import torch

from dnf_pyg.mesh import (
    edges,
    face_areas,
    face_centroids,
    face_normals,
    filled_face_normals,
    mean_edge_length,
    vertex_normals,
)


def test_normals_areas_centroids_match_trimesh_formulas(sphere_mesh):
    pos, face = sphere_mesh
    for f in range(0, face.size(1), 17):
        a, b, c = pos[face[:, f]]
        cross = torch.linalg.cross(b - a, c - a)
        torch.testing.assert_close(face_normals(pos, face)[f], cross / cross.norm())
        torch.testing.assert_close(face_areas(pos, face)[f], cross.norm() / 2)
        torch.testing.assert_close(face_centroids(pos, face)[f], (a + b + c) / 3)


def test_vertex_normals_match_loop(sphere_mesh):
    pos, face = sphere_mesh
    total = torch.zeros_like(pos)
    for f in range(face.size(1)):
        for v in face[:, f].tolist():
            total[v] += face_areas(pos, face)[f] * face_normals(pos, face)[f]
    torch.testing.assert_close(vertex_normals(pos, face), total / total.norm(dim=1, keepdim=True))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_dtype_is_kept(sphere_mesh, dtype):
    pos, face = sphere_mesh[0].to(dtype), sphere_mesh[1]
    for function in (face_normals, face_areas, face_centroids, vertex_normals, mean_edge_length, filled_face_normals):
        assert function(pos, face).dtype == dtype


@pytest.mark.parametrize("size", [1e-90, 1e-6, 1e6, 1e90])
def test_normals_do_not_depend_on_size(sphere_mesh, size):
    pos, face = sphere_mesh
    torch.testing.assert_close(face_normals(pos * size, face), face_normals(pos, face))
    torch.testing.assert_close(vertex_normals(pos * size, face), vertex_normals(pos, face))
    torch.testing.assert_close(mean_edge_length(pos * size, face) / size, mean_edge_length(pos, face))


def test_far_from_the_origin(sphere_mesh):
    pos, face = sphere_mesh
    torch.testing.assert_close(face_normals(pos + 1e6, face), face_normals(pos, face), atol=1e-8, rtol=0)


def test_edges_of_a_sphere(sphere_mesh):
    pos, face = sphere_mesh
    edge = edges(face)
    assert edge.shape == (2, 480)  # Euler: V - E + F = 2
    assert (edge[0] < edge[1]).all()
    length = (pos[edge[0]] - pos[edge[1]]).norm(dim=1)
    torch.testing.assert_close(mean_edge_length(pos, face), length.mean())


def test_mesh_without_edges():
    pos, face = torch.ones(2, 3), torch.tensor([[0], [0], [0]])
    assert edges(face).shape == (2, 0)
    assert edges(torch.empty(3, 0, dtype=torch.long)).shape == (2, 0)
    assert mean_edge_length(pos, face) == 0


def test_zero_area_face_has_no_normal():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]])
    face = torch.tensor([[0, 0, 0], [1, 1, 1], [2, 1, 3]])  # collinear, repeated vertex, sound
    assert face_normals(pos, face).tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 1]]
    assert face_areas(pos, face).tolist() == [0, 0, 0.5]


def test_sliver_counts_as_zero_area():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0.5, 1e-13, 0]], dtype=torch.double)
    assert not face_normals(pos, torch.tensor([[0], [1], [2]])).any()


def test_missing_normal_is_filled_from_around():
    pos = torch.tensor([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0], [9, 9, 9]])
    face = torch.tensor([[0, 0, 4], [1, 3, 4], [2, 1, 4]])  # sound, collinear beside it, a point by itself
    assert filled_face_normals(pos, face).tolist() == [[0, 0, 1], [0, 0, 1], [0, 0, 1]]
    tilted = pos[:, [2, 0, 1]]
    assert filled_face_normals(tilted, face).tolist() == [[1, 0, 0], [1, 0, 0], [0, 0, 1]]


def test_filled_normals_are_unit_where_faces_cancel():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    face = torch.tensor([[0, 0, 0], [1, 2, 1], [2, 1, 1]])  # two faces back to back, one edge
    assert filled_face_normals(pos, face)[2].norm() == 1
    assert vertex_normals(pos, face).tolist() == [[0, 0, 0]] * 3


def test_unreferenced_vertex_has_no_normal(sphere_mesh):
    pos, face = sphere_mesh
    normal = vertex_normals(torch.cat([pos, pos.new_full((1, 3), 5.0)]), face)
    assert normal[-1].tolist() == [0, 0, 0]
    torch.testing.assert_close(normal[:-1], vertex_normals(pos, face))


def test_mixed_winding_flips_only_its_face(sphere_mesh):
    pos, face = sphere_mesh
    flipped = face.clone()
    flipped[:, 7] = face[[0, 2, 1], 7]
    expected = face_normals(pos, face)
    expected[7] *= -1
    torch.testing.assert_close(face_normals(pos, flipped), expected)


def test_gradient_reaches_positions(sphere_mesh):
    pos, face = sphere_mesh[0].clone().requires_grad_(), sphere_mesh[1]
    face_normals(pos, face)[:, 0].sum().backward()
    assert math.isfinite(pos.grad.abs().sum())
