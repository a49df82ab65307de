import torch
from torch_geometric.data import Data

from dnf_pyg.transforms import RandomRotation


def test_rotation_turns_both_alike(data):
    turned = RandomRotation(torch.Generator().manual_seed(1))(data)
    rotation = torch.linalg.lstsq(data.normal, turned.normal).solution
    torch.testing.assert_close(rotation @ rotation.t(), torch.eye(3))
    assert torch.linalg.det(rotation) > 0.999
    torch.testing.assert_close(data.clean_normal @ rotation, turned.clean_normal)
    assert not torch.allclose(turned.normal, data.normal)
    assert torch.equal(turned.face_id, data.face_id)


def test_rotation_turns_places_and_keeps_areas(data):
    surface = torch.cat([data.normal, torch.rand(500, 1)], dim=1)
    turned = RandomRotation(torch.Generator().manual_seed(1))(Data(normal=data.normal, surface=surface))
    torch.testing.assert_close(turned.surface[:, :3], turned.normal)
    assert torch.equal(turned.surface[:, 3], surface[:, 3])


def test_rotation_is_uniform():
    transform = RandomRotation(torch.Generator().manual_seed(2))
    up = torch.cat([transform(Data(normal=torch.tensor([[0.0, 0, 1]]))).normal for _ in range(3000)])
    assert up.mean(dim=0).abs().max() < 0.05
    torch.testing.assert_close(up.t() @ up / 3000, torch.eye(3) / 3, atol=0.03, rtol=0)


def test_rotation_is_repeatable_and_needs_no_target(data):
    one, two = (RandomRotation(torch.Generator().manual_seed(5))(Data(normal=data.normal)) for _ in range(2))
    assert torch.equal(one.normal, two.normal)
    assert "clean_normal" not in one


def test_rotation_leaves_the_input_unchanged(data):
    before = data.normal.clone()
    RandomRotation()(data)
    assert torch.equal(data.normal, before)


def test_repr():
    assert str(RandomRotation()) == "RandomRotation()"
