import itertools
import math

import pytest
import torch

from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.baselines import GuidedNormalFilter
from dnf_pyg.mesh.geometry import angular_difference, face_areas, face_centroids, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.mesh.vertex_update import update_vertices


def noisy(mesh, level=0.2):
    pos, face = mesh
    return GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(0))


def shared_vertices(face):
    corners = [set(f) for f in face.t().tolist()]
    return [[len(a & b) for b in corners] for a in corners]


def reached(i, shared, centroid, radius):
    """Faces connected with face i over faces within the radius."""
    inside = {i}
    border = [i]
    while border:
        at = border.pop()
        for j, number in enumerate(shared[at]):
            if number and j not in inside and float((centroid[i] - centroid[j]).norm()) <= radius:
                inside.add(j)
                border.append(j)
    return inside


def unevenness(patch, normal, shared):
    """H(P) as in the formula, over all pairs of faces and all edges inside the patch."""
    pairs = list(itertools.combinations(patch, 2))
    difference = {(j, k): float((normal[j] - normal[k]).norm()) for j, k in pairs}
    at_edges = [difference[pair] for pair in pairs if shared[pair[0]][pair[1]] == 2]
    return max(difference.values()) * max(at_edges) / (1e-9 + sum(at_edges))


def loop(pos, face, sigma_range, radius, num_iterations, num_vertex_iterations):
    shared = shared_vertices(face)
    num_faces = face.size(1)
    adjacent = [(i, j) for i in range(num_faces) for j in range(num_faces) if i != j and shared[i][j] == 2]

    def spacing(centroid):
        return sum(float((centroid[i] - centroid[j]).norm()) for i, j in adjacent) / len(adjacent)

    centroid = face_centroids(pos, face)
    near = [reached(i, shared, centroid, radius * spacing(centroid)) for i in range(num_faces)]
    patch = [[j for j in range(num_faces) if shared[i][j]] for i in range(num_faces)]
    for _ in range(num_iterations):
        normal, area, centroid = face_normals(pos, face), face_areas(pos, face), face_centroids(pos, face)
        sigma = spacing(centroid)
        score = [unevenness(patch[i], normal, shared) for i in range(num_faces)]
        mean = [sum(area[j] * normal[j] for j in patch[i]) for i in range(num_faces)]
        guide = []
        for i in range(num_faces):
            best = mean[min(patch[i], key=lambda j: score[j])]
            guide.append(best / best.norm())
        filtered = []
        for i in range(num_faces):
            total = torch.zeros(3, dtype=pos.dtype)
            for j in near[i]:
                close = math.exp(-float((centroid[i] - centroid[j]).square().sum()) / (2 * sigma**2))
                alike = math.exp(-float((guide[i] - guide[j]).square().sum()) / (2 * sigma_range**2))
                total += area[j] * close * alike * normal[j]
            filtered.append(total / total.norm())
        filtered = torch.stack(filtered)
        pos = update_vertices(pos, face, filtered, num_vertex_iterations)
    return pos, filtered


def test_equals_a_loop_over_faces(sphere_mesh):
    pos, face = noisy(sphere_mesh, 0.3), sphere_mesh[1]
    result = GuidedNormalFilter(sigma_range=0.3, radius=2.5, num_iterations=2, num_vertex_iterations=4)(pos, face)
    expected_pos, expected_normal = loop(pos, face, 0.3, 2.5, 2, 4)
    torch.testing.assert_close(result.normal, expected_normal)
    torch.testing.assert_close(result.pos, expected_pos)


def test_denoises_a_cube_and_keeps_its_edges(cube_mesh):
    clean, face = cube_mesh
    pos = noisy(cube_mesh)
    after = angular_difference(face_normals(GuidedNormalFilter()(pos, face).pos, face), face_normals(clean, face))
    assert after.mean() < 2.5


def test_keeps_dtype_and_input(cube_mesh):
    pos, face = noisy(cube_mesh).float(), cube_mesh[1]
    before = pos.clone()
    result = GuidedNormalFilter(num_iterations=1)(pos, face)
    assert result.pos.dtype == result.normal.dtype == torch.float32
    assert torch.equal(pos, before)


def test_lone_and_zero_area_faces_keep_a_finite_normal():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9], [9, 9, 8], [9, 8, 9]])
    face = torch.tensor([[0, 0, 4], [1, 1, 5], [2, 3, 6]])  # a face, a face without area beside it, a lone face
    result = GuidedNormalFilter(num_iterations=2)(pos, face)
    torch.testing.assert_close(result.normal.norm(dim=-1), torch.ones(3))
    torch.testing.assert_close(result.normal[2], face_normals(pos, face)[2])
    assert result.pos.isfinite().all()


def test_mesh_without_faces():
    with pytest.raises(MeshError, match="0 faces"):
        GuidedNormalFilter()(torch.zeros(3, 3), torch.zeros(3, 0, dtype=torch.long))
