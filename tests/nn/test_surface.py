import torch

from dnf_pyg.nn.surface import patch_surface


def random_surface(num_faces):
    return torch.cat([torch.randn(num_faces, 3), torch.rand(num_faces, 1) + 0.1], dim=1)


def test_value_of_each_face():
    surface, batch = random_surface(7), torch.tensor([0, 0, 0, 1, 1, 1, 1])
    place, area = patch_surface(surface, batch)
    for i, patch in enumerate(batch.tolist()):
        mean = surface[batch == patch, 3].mean()
        torch.testing.assert_close(place[i, :3], surface[i, :3] / mean.sqrt())
        torch.testing.assert_close(area[i, 0], surface[i, 3] / mean)
        torch.testing.assert_close(place[i, 3], area[i, 0].log())


def test_size_of_the_mesh_does_not_matter():
    surface = random_surface(9)
    larger = surface * torch.tensor([50.0, 50.0, 50.0, 2500.0])
    torch.testing.assert_close(patch_surface(larger), patch_surface(surface))


def test_places_are_written_in_the_frame():
    surface = random_surface(5)
    frame = torch.linalg.qr(torch.randn(3, 3)).Q
    place, _ = patch_surface(surface, None, frame.unsqueeze(0))
    torch.testing.assert_close(place[:, :3], patch_surface(surface)[0][:, :3] @ frame)


def test_faces_without_area_are_finite():
    place, area = patch_surface(torch.zeros(3, 4))
    assert torch.isfinite(place).all()
    assert (area > 0).all()
    some = torch.tensor([[0.0, 0, 0, 0], [1, 0, 0, 2]])
    torch.testing.assert_close(patch_surface(some)[1], torch.tensor([[1e-4], [2.0]]))
