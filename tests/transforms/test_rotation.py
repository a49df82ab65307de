import torch
from torch_geometric.data import Data

from dnf_pyg.transforms import RandomRotation


def test_rotation_turns_both_alike(data):
    turned = RandomRotation(torch.Generator().manual_seed(1))(data)
    rotation = torch.linalg.lstsq(data.x, turned.x).solution
    torch.testing.assert_close(rotation @ rotation.t(), torch.eye(3))
    assert torch.linalg.det(rotation) > 0.999
    torch.testing.assert_close(data.y @ rotation, turned.y)
    assert not torch.allclose(turned.x, data.x)
    assert torch.equal(turned.face_id, data.face_id)


def test_rotation_turns_places_and_keeps_areas(data):
    area = torch.rand(500)
    turned = RandomRotation(torch.Generator().manual_seed(1))(
        Data(x=data.x, pos=data.x, area=area, earlier=torch.stack([data.x, data.x], dim=1))
    )
    torch.testing.assert_close(turned.pos, turned.x)
    torch.testing.assert_close(turned.earlier, torch.stack([turned.x, turned.x], dim=1))
    assert torch.equal(turned.area, area)


def test_rotation_is_uniform():
    transform = RandomRotation(torch.Generator().manual_seed(2))
    up = torch.cat([transform(Data(x=torch.tensor([[0.0, 0, 1]]))).x for _ in range(3000)])
    assert up.mean(dim=0).abs().max() < 0.05
    torch.testing.assert_close(up.t() @ up / 3000, torch.eye(3) / 3, atol=0.03, rtol=0)


def test_rotation_is_repeatable_and_needs_no_target(data):
    one, two = (RandomRotation(torch.Generator().manual_seed(5))(Data(x=data.x)) for _ in range(2))
    assert torch.equal(one.x, two.x)
    assert "y" not in one


def test_rotation_leaves_the_input_unchanged(data):
    before = data.x.clone()
    RandomRotation()(data)
    assert torch.equal(data.x, before)


def test_repr():
    assert str(RandomRotation()) == "RandomRotation()"
