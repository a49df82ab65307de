import pytest
import torch

from dnf_pyg.nn import ChannelAttention

BATCH = torch.tensor([0, 0, 0, 1, 2, 2])


@pytest.mark.parametrize("training", [False, True])
def test_matches_loops(training, loops, make):
    layer = make.scramble(ChannelAttention(8)).train(training)
    x = torch.randn(6, 8, requires_grad=True)
    expected = loops.channel_attention(layer, x, BATCH)
    expected_grads = make.gradients(expected, [x, *layer.parameters()])
    out = layer(x, BATCH)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    torch.testing.assert_close(make.gradients(out, [x, *layer.parameters()]), expected_grads, rtol=0, atol=1e-10)
    torch.testing.assert_close(layer(x, BATCH, batch_size=3), expected, rtol=0, atol=1e-10)


def test_each_patch_alone_gives_the_same(make):
    layer = make.scramble(ChannelAttention(8)).eval()
    x = torch.randn(6, 8)
    alone = torch.cat([layer(x[p == BATCH]) for p in range(3)])
    torch.testing.assert_close(layer(x, BATCH), alone, rtol=0, atol=1e-12)


def test_one_patch_trains_on_the_running_statistics(make):
    layer = make.scramble(ChannelAttention(8))
    x, before = torch.randn(5, 8), layer.squeeze_norm.running_mean.clone()
    out = layer.train()(x)
    torch.testing.assert_close(out, layer.eval()(x), rtol=0, atol=0)
    torch.testing.assert_close(layer.train()(x, torch.zeros(5, dtype=torch.long)), out, rtol=0, atol=1e-12)
    torch.testing.assert_close(layer.squeeze_norm.running_mean, before, rtol=0, atol=0)
    assert all(g.abs().sum() > 0 for g in make.gradients(out, list(layer.parameters())))


def test_running_statistics_follow_training():
    layer = ChannelAttention(8)
    layer(torch.randn(6, 8) + 5, BATCH)
    assert layer.squeeze_norm.num_batches_tracked == 1
    assert layer.squeeze_norm.running_mean.abs().sum() > 0


def test_gradcheck(make):
    layer = make.scramble(ChannelAttention(4))
    assert torch.autograd.gradcheck(lambda x: layer(x, BATCH), torch.randn(6, 4, requires_grad=True))


def test_compile(make):
    layer = make.scramble(ChannelAttention(8)).eval()
    compiled = torch.compile(layer, dynamic=True, fullgraph=True, backend="eager")
    for x in (torch.randn(6, 8), torch.randn(4, 8)):
        torch.testing.assert_close(compiled(x), layer(x), rtol=0, atol=1e-10)


def test_repr_reset_and_errors(make):
    layer = make.scramble(ChannelAttention(8))
    assert str(layer) == "ChannelAttention(8, reduction=4)"
    layer.reset_parameters()
    assert layer.excite_norm.weight.tolist() == [1.0] * 8
    with pytest.raises(ValueError, match=r"\[num_faces, 8\] \(got \[4, 5\]\)"):
        layer(torch.randn(4, 5))
    with pytest.raises(ValueError, match=r"at least the reduction 4 \(got 3\)"):
        ChannelAttention(3)
