import pytest
import torch
import trimesh

from dnf_pyg.mesh.geometry import mean_edge_length, vertex_normals
from dnf_pyg.mesh.noise_level import estimate_noise_level


def as_tensors(mesh):
    return torch.tensor(mesh.vertices, dtype=torch.float64), torch.tensor(mesh.faces).t().contiguous()


@pytest.fixture
def fine_cube(cube_mesh):
    pos, face = cube_mesh
    return as_tensors(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False).subdivide())


@pytest.mark.parametrize("level", [0.05, 0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_finds_the_noise_that_was_added(shape, level, fine_cube):
    pos, face = fine_cube if shape == "cube" else as_tensors(trimesh.creation.icosphere(subdivisions=4))
    draw = torch.randn(len(pos), 1, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    noisy = pos + level * mean_edge_length(pos, face) * draw * vertex_normals(pos, face)
    assert estimate_noise_level(noisy, face) == pytest.approx(level, rel=0.15, abs=0.02)


def test_clean_meshes_have_little(fine_cube):
    assert estimate_noise_level(*fine_cube) < 0.01
    assert estimate_noise_level(*as_tensors(trimesh.creation.icosphere(subdivisions=4))) < 0.01


def test_does_not_depend_on_unit_or_place(sphere_mesh):
    pos, face = sphere_mesh
    noisy = pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    level = estimate_noise_level(noisy, face)
    assert estimate_noise_level(1e-4 * noisy + 10, face) == pytest.approx(level, rel=1e-6)


def test_loose_vertices_and_empty_meshes(sphere_mesh):
    pos, face = sphere_mesh
    lone = torch.cat([pos, pos.new_full((1000, 3), 5.0)])
    assert estimate_noise_level(lone, face) == pytest.approx(estimate_noise_level(pos, face), rel=1e-6)
    assert estimate_noise_level(torch.zeros(3, 3), torch.tensor([[0], [1], [2]])) == 0.0
