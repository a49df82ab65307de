import pytest
import torch

from dnf_pyg.mesh.correspondence import corresponding_faces


@pytest.fixture
def pair(sphere_mesh):
    """A sphere with noise, and the clean one."""
    pos, face = sphere_mesh
    return pos + 0.03 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype), pos, face


def shuffled(num):
    return torch.randperm(num, generator=torch.Generator().manual_seed(1))


def test_same_order(pair):
    noisy, pos, face = pair
    assert torch.equal(corresponding_faces(noisy, face, pos, face), torch.arange(320))
    assert torch.equal(corresponding_faces(noisy, face, pos, face[[1, 2, 0]]), torch.arange(320))


def test_faces_of_the_same_vertices_in_another_order(pair):
    noisy, pos, face = pair
    other = face[[2, 0, 1]][:, shuffled(320)]
    order = corresponding_faces(noisy, face, pos, other)
    assert torch.equal(other[[1, 2, 0]][:, order], face)


def test_other_vertices_in_another_order(pair):
    noisy, pos, face = pair
    number = shuffled(162)
    moved = torch.empty_like(pos)
    moved[number] = pos
    other = number[face[:, shuffled(320)]]
    order = corresponding_faces(noisy, face, moved, other)
    right = (moved[other[:, order]].mean(dim=0) - pos[face].mean(dim=0)).norm(dim=1) < 1e-9
    assert right.double().mean() > 0.95


def test_triangles_one_by_one_in_the_same_order(pair):
    noisy, pos, face = pair
    soup = pos[face.t().flatten()]
    assert torch.equal(corresponding_faces(noisy, face, soup, torch.arange(960).view(-1, 3).t()), torch.arange(320))


def test_another_mesh_is_left_as_it_is(pair):
    noisy, pos, face = pair
    far = pos[:, [2, 0, 1]][torch.randperm(162, generator=torch.Generator().manual_seed(2))] + 100
    assert torch.equal(corresponding_faces(noisy, face, far[:-1], face.clamp(max=160)), torch.arange(320))
