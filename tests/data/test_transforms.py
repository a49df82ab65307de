import pytest
import torch
from torch_geometric.data import Data

from dnf_pyg.data import JitterNormal, RandomRotation


@pytest.fixture
def data():
    normal = torch.nn.functional.normalize(torch.randn(500, 3, generator=torch.Generator().manual_seed(0)), dim=1)
    return Data(normal=normal, clean_normal=normal.flip(0), face_id=torch.arange(500))


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


def test_jitter_moves_the_input_only(data):
    jittered = JitterNormal(sigma=0.005, clip=0.01, generator=torch.Generator().manual_seed(1))(data)
    torch.testing.assert_close(jittered.normal.norm(dim=1), torch.ones(500))
    assert torch.equal(jittered.clean_normal, data.clean_normal)
    moved = (jittered.normal - data.normal).abs()
    assert 0 < moved.max() < 0.03
    assert 0.002 < (jittered.normal - data.normal).std() < 0.006


def test_original_is_not_changed(data):
    before = data.normal.clone()
    RandomRotation()(data)
    JitterNormal()(data)
    assert torch.equal(data.normal, before)


def test_repr():
    assert str(RandomRotation()) == "RandomRotation()"
    assert str(JitterNormal(0.1, 0.2)) == "JitterNormal(sigma=0.1, clip=0.2)"


@pytest.mark.parametrize("name", ["sigma", "clip"])
def test_jitter_rejects_negative_values(name):
    with pytest.raises(ValueError, match=rf"Expected '{name}' of at least 0 \(got -1\)"):
        JitterNormal(**{name: -1})
