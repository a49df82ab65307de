import pytest
import torch

from dnf_pyg.nn import MultiScaleEmbedding
from dnf_pyg.nn.neighbors import sort_by_center

BATCH = torch.tensor([0] * 5 + [1] * 4)
DEGREES = [4, 4, 3, 4, 4, 2, 4, 4, 1]


def patches(make):
    edge_index = make.random_edges(DEGREES, 4)
    edge_index[0] += 5 * BATCH[edge_index[1]]
    return torch.nn.functional.normalize(torch.randn(9, 3), dim=1), edge_index


@pytest.mark.parametrize("subtract", [False, True])
@pytest.mark.parametrize("training", [False, True])
def test_matches_loops(subtract, training, loops, make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6, subtract)).train(training)
    normal, edge_index = patches(make)
    normal.requires_grad_()
    levels = [normal]
    for level, (conv, attention) in enumerate(zip(layer.convs, layer.attentions, strict=True)):
        edges = sort_by_center(edge_index, (9, 9), (2, 3)[level]).as_tensor()
        x = loops.edge_mlp_max(conv.mlp, levels[-1], levels[-1], edges, subtract=subtract and level > 0)
        levels.append(loops.channel_attention(attention, x, BATCH))
    x = torch.cat(levels, dim=1) @ layer.fuse.lins[0].weight.t() + layer.fuse.lins[0].bias
    norm = layer.fuse.norms[0].module
    mean, var = (x.mean(0), x.var(0, correction=0)) if training else (norm.running_mean, norm.running_var)
    expected = ((x - mean) / (var + norm.eps).sqrt() * norm.weight + norm.bias).clamp(min=0)
    expected_grads = make.gradients(expected, [normal, *layer.parameters()])
    out = layer(normal, edge_index, BATCH)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    torch.testing.assert_close(make.gradients(out, [normal, *layer.parameters()]), expected_grads, rtol=0, atol=1e-10)


@pytest.mark.parametrize("training", [False, True])
def test_every_level_sees_places(training, loops, make):
    """The reference lists the offset of each edge beside the features of its two faces."""
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6, surface=True)).train(training)
    normal, edge_index = patches(make)
    place, size = torch.randn(9, 3), torch.randn(9, 1)
    levels = [torch.cat([normal, size], dim=1)]
    for level, (conv, attention) in enumerate(zip(layer.convs, layer.attentions, strict=True)):
        neighbor, center = sort_by_center(edge_index, (9, 9), (2, 3)[level]).as_tensor()
        x = levels[-1]
        h = torch.cat([x[center], x[neighbor] - x[center], place[neighbor] - place[center]], dim=1)
        h = torch.stack(loops.mlp_on_rows(conv.mlp, h))
        h = torch.stack([h[center == i].amax(dim=0) for i in range(9)])
        levels.append(loops.channel_attention(attention, h, BATCH))
    x = torch.cat(levels, dim=1) @ layer.fuse.lins[0].weight.t() + layer.fuse.lins[0].bias
    expected = torch.stack(loops.normalize(x, layer.fuse.norms[0].module)).clamp(min=0)
    out = layer(normal, edge_index, BATCH, surface=torch.cat([place, size], dim=1))
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)


def test_edges_per_level(make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6)).eval()
    normal, edge_index = patches(make)
    cut = [sort_by_center(edge_index, (9, 9), k) for k in (2, 3)]
    torch.testing.assert_close(layer(normal, cut, BATCH), layer(normal, edge_index, BATCH), rtol=0, atol=0)
    with pytest.raises(ValueError, match=r"each of 2 levels \(got 3\)"):
        layer(normal, [edge_index] * 3, BATCH)


def test_reset_and_errors(make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6))
    layer.reset_parameters()
    assert layer.fuse.norms[0].module.weight.tolist() == [1.0] * 6
    with pytest.raises(ValueError, match=r"equal length \(got \[2, 3\] and \[8\]\)"):
        MultiScaleEmbedding((2, 3), (8,))
