import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.surface_distance import surface_distance


def soup(seed, num_faces, spread=1.0):
    """Unconnected triangles of very different sizes, some of them without area."""
    generator = torch.Generator().manual_seed(seed)
    centre = torch.randn(num_faces, 1, 3, generator=generator, dtype=torch.float64)
    size = (spread * torch.randn(num_faces, 1, 1, generator=generator, dtype=torch.float64)).exp()
    corner = centre + 0.1 * size * torch.randn(num_faces, 3, 3, generator=generator, dtype=torch.float64)
    return corner.reshape(-1, 3), torch.arange(3 * num_faces).view(num_faces, 3).t()


def by_trimesh(point, pos, face):
    mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
    return torch.from_numpy(trimesh.proximity.closest_point(mesh, point.numpy())[1])


@pytest.mark.parametrize("num_faces", [1, 2, 4, 5, 17, 400])
def test_equals_trimesh_on_triangles_of_all_sizes(num_faces):
    pos, face = soup(num_faces, num_faces, spread=1.5)
    point = 3 * torch.randn(200, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    torch.testing.assert_close(surface_distance(point, pos, face), by_trimesh(point, pos, face), rtol=1e-9, atol=1e-12)


def test_equals_the_distance_to_densely_sampled_triangles(sphere_mesh):
    """A slow loop over all triangles, independent of trimesh."""
    pos, face = sphere_mesh
    grid = [(i / 60, j / 60) for i in range(61) for j in range(61 - i)]
    share = torch.tensor([(1 - u - v, u, v) for u, v in grid], dtype=torch.float64)
    sample = torch.einsum("sc,cfx->fsx", share, pos[face]).reshape(-1, 3)
    point = torch.randn(20, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    distance = surface_distance(point, pos, face)
    for i, p in enumerate(point):
        sampled = float((sample - p).norm(dim=-1).min())
        assert distance[i] <= sampled + 1e-12
        assert distance[i] == pytest.approx(sampled, abs=5e-4)


def test_points_on_the_surface_are_at_distance_zero(cube_mesh):
    pos, face = cube_mesh
    assert surface_distance(pos, pos, face).max() == 0
    assert surface_distance(pos[face].mean(dim=0), pos, face).max() < 1e-15


def test_faces_without_area():
    pos = torch.tensor([[0.0, 0, 0], [2, 0, 0], [1, 0, 0], [0, 0, 9]], dtype=torch.float64)
    face = torch.tensor([[0, 3], [1, 3], [2, 3]])  # a segment and a point
    point = torch.tensor([[1.5, 3, 0], [0, 0, 8], [-3, -4, 0]], dtype=torch.float64)
    assert surface_distance(point, pos, face).tolist() == [3, 1, 5]


def test_all_triangles_at_one_place():
    pos, face = soup(0, 1)
    point = torch.ones(1, 3, dtype=torch.float64)
    torch.testing.assert_close(surface_distance(point, pos, face.repeat(1, 50)), surface_distance(point, pos, face))


def test_far_from_the_origin(sphere_mesh):
    pos, face = sphere_mesh
    point = torch.tensor([[2.0, 0, 0]], dtype=torch.float64)
    offset = torch.tensor([1e6, -1e6, 1e6], dtype=torch.float64)
    near, far = surface_distance(point, pos, face), surface_distance(point + offset, pos + offset, face)
    np.testing.assert_allclose(far, near, rtol=1e-8)


def test_without_faces():
    with pytest.raises(ValueError, match="at least one face"):
        surface_distance(torch.zeros(1, 3), torch.zeros(3, 3), torch.zeros(3, 0, dtype=torch.long))
