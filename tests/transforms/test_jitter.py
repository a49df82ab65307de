import pytest
import torch

from dnf_pyg.transforms import JitterNormal


def test_jitter_moves_the_input_only(data):
    jittered = JitterNormal(sigma=0.005, clip=0.01, generator=torch.Generator().manual_seed(1))(data)
    torch.testing.assert_close(jittered.x.norm(dim=1), torch.ones(500))
    assert torch.equal(jittered.y, data.y)
    moved = (jittered.x - data.x).abs()
    assert 0 < moved.max() < 0.03
    assert 0.002 < (jittered.x - data.x).std() < 0.006


def test_jitter_leaves_the_input_unchanged(data):
    before = data.x.clone()
    JitterNormal()(data)
    assert torch.equal(data.x, before)


def test_repr():
    assert str(JitterNormal(0.1, 0.2)) == "JitterNormal(sigma=0.1, clip=0.2)"


@pytest.mark.parametrize("name", ["sigma", "clip"])
def test_jitter_rejects_negative_values(name):
    with pytest.raises(ValueError, match=rf"Expected '{name}' of at least 0 \(got -1\)"):
        JitterNormal(**{name: -1})
