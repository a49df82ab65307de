import torch

from dnf_pyg.nn.surface import patch_surface


def random_surface(num_faces):
    return torch.randn(num_faces, 3), torch.rand(num_faces) + 0.1


def test_value_of_each_face():
    (pos, area), batch = random_surface(7), torch.tensor([0, 0, 0, 1, 1, 1, 1])
    place, relative = patch_surface(pos, area, batch)
    for i, patch in enumerate(batch.tolist()):
        mean = area[batch == patch].mean()
        torch.testing.assert_close(place[i], pos[i] / mean.sqrt())
        torch.testing.assert_close(relative[i, 0], area[i] / mean)


def test_size_of_the_mesh_does_not_matter():
    pos, area = random_surface(9)
    torch.testing.assert_close(patch_surface(50 * pos, 2500 * area), patch_surface(pos, area))


def test_faces_without_area_are_finite():
    place, relative = patch_surface(torch.zeros(3, 3), torch.zeros(3))
    assert torch.isfinite(place).all()
    assert (relative > 0).all()
    torch.testing.assert_close(
        patch_surface(torch.eye(2, 3), torch.tensor([0.0, 2.0]))[1], torch.tensor([[1e-4], [2.0]])
    )


def test_places_beside_needles_are_limited():
    pos = torch.tensor([[0.0, 0, 0], [3, -1, 0]])
    assert patch_surface(pos, torch.zeros(2))[0].tolist() == [[0, 0, 0], [1e4, -1e4, 0]]
