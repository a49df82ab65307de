import pytest
import torch
import trimesh

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.synthetic.depth_image import depth_image_mesh


@pytest.fixture
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=5)
    return torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t()


@pytest.mark.parametrize("falling", [False, True])
def test_vertices_lie_on_the_grid_and_on_the_front_of_the_surface(ball, falling):
    seen, triangles = depth_image_mesh(*ball, num_pixels=40, falling=falling)
    assert torch.equal(seen[:, :2] % 1, torch.full((len(seen), 2), 0.5, dtype=torch.double))
    centred = seen - torch.tensor([20.0, 20.0, 20.0])
    torch.testing.assert_close(
        centred.norm(dim=1), torch.full((len(seen),), 20.0, dtype=torch.double), rtol=0, atol=0.1
    )
    assert (centred[:, 2] < 0).all()  # towards the viewer
    normal = face_normals(seen, triangles)
    assert (normal[:, 2] < 0).all()
    assert ((normal * centred[triangles].mean(dim=0)).sum(dim=1) > 0).all()  # outward


def test_faces_across_a_jump_of_depth_are_left_out():
    pos = torch.tensor([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0], [4, 0, 9], [8, 0, 9], [4, 4, 9], [8, 4, 9]])
    face = torch.tensor([[0, 1, 4, 5], [2, 2, 6, 6], [1, 3, 5, 7]])
    seen, triangles = depth_image_mesh(pos, face, num_pixels=8)
    depth = seen[:, 2][triangles]
    assert (depth.amax(dim=0) - depth.amin(dim=0)).max() == 0
    assert sorted(seen[:, 2].unique().tolist()) == [0, 9]
    _, bridged = depth_image_mesh(pos, face, num_pixels=8, max_jump=10)
    assert bridged.size(1) == triangles.size(1) + 2 * 3


def test_rotation_comes_first(ball):
    pos, face = ball
    turn = torch.tensor([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=torch.double)
    pos = pos * torch.tensor([1.0, 2.0, 3.0])
    one, two = depth_image_mesh(pos, face, 30, turn), depth_image_mesh(pos @ turn.t(), face, 30)
    torch.testing.assert_close(one, two)


def test_image_without_faces():
    with pytest.raises(MeshError, match=r"\(got none of 4 x 4\)\. Raise 'num_pixels'"):
        depth_image_mesh(torch.tensor([[0.0, 0, 0], [1, 0, 0], [2, 0, 1]]), torch.tensor([[0], [1], [2]]), 4)
