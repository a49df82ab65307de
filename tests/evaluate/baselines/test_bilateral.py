import math

import pytest
import torch

from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.baselines import BilateralNormalFilter
from dnf_pyg.mesh.geometry import angular_difference, face_areas, face_centroids, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.mesh.vertex_update import update_vertices


def noisy(mesh, level=0.2):
    pos, face = mesh
    return GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(0))


def neighbours(face, i, shared):
    """Faces that share at least so many vertices with face i."""
    corners = [set(f) for f in face.t().tolist()]
    return [j for j, other in enumerate(corners) if j != i and len(other & corners[i]) >= shared]


def mean_spacing(pos, face):
    centroid = face_centroids(pos, face)
    length = [float((centroid[i] - centroid[j]).norm()) for i in range(face.size(1)) for j in neighbours(face, i, 2)]
    return sum(length) / len(length)


def loop(pos, face, sigma_range, num_iterations):
    """The formula, face by face."""
    centroid, area, normal = face_centroids(pos, face), face_areas(pos, face), face_normals(pos, face)
    sigma = mean_spacing(pos, face)
    ring = [neighbours(face, i, 1) for i in range(face.size(1))]
    for _ in range(num_iterations):
        filtered = []
        for i in range(face.size(1)):
            total = torch.zeros(3, dtype=pos.dtype)
            for j in ring[i]:
                near = math.exp(-float((centroid[i] - centroid[j]).square().sum()) / (2 * sigma**2))
                alike = math.exp(-float((normal[i] - normal[j]).square().sum()) / (2 * sigma_range**2))
                total += area[j] * near * alike * normal[j]
            filtered.append(total / total.norm())
        normal = torch.stack(filtered)
    return normal


def test_equals_a_loop_over_faces(sphere_mesh):
    pos, face = noisy(sphere_mesh), sphere_mesh[1]
    result = BilateralNormalFilter(sigma_range=0.3, num_iterations=3)(pos, face)
    torch.testing.assert_close(result.normal, loop(pos, face, 0.3, 3))
    torch.testing.assert_close(result.pos, update_vertices(pos, face, result.normal, 20))


def test_denoises_a_cube(cube_mesh):
    clean, face = cube_mesh
    pos = noisy(cube_mesh)
    before = angular_difference(face_normals(pos, face), face_normals(clean, face)).mean()
    after = angular_difference(face_normals(BilateralNormalFilter()(pos, face).pos, face), face_normals(clean, face))
    assert before > 15
    assert after.mean() < 3


def test_keeps_dtype_and_input(cube_mesh):
    pos, face = noisy(cube_mesh).float(), cube_mesh[1]
    before = pos.clone()
    result = BilateralNormalFilter(num_iterations=1)(pos, face)
    assert result.pos.dtype == result.normal.dtype == torch.float32
    assert torch.equal(pos, before)


def test_lone_and_zero_area_faces_keep_a_finite_normal():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9], [9, 9, 8], [9, 8, 9]])
    face = torch.tensor([[0, 0, 4], [1, 1, 5], [2, 3, 6]])  # a face, a face without area beside it, a lone face
    result = BilateralNormalFilter()(pos, face)
    torch.testing.assert_close(result.normal.norm(dim=-1), torch.ones(3))
    torch.testing.assert_close(result.normal[2], face_normals(pos, face)[2])
    assert result.pos.isfinite().all()


def test_mesh_without_faces():
    with pytest.raises(MeshError, match="0 faces"):
        BilateralNormalFilter()(torch.zeros(3, 3), torch.zeros(3, 0, dtype=torch.long))
