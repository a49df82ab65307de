import pytest
import torch

from dnf_pyg.nn import MultiScaleEmbedding
from dnf_pyg.nn.neighbors import edges_per_level

BATCH = torch.tensor([0] * 5 + [1] * 4)


@pytest.mark.parametrize("subtract", [False, True])
@pytest.mark.parametrize("training", [False, True])
def test_matches_loops(subtract, training, loops, make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6, subtract)).train(training)
    normal, edge_index, rank = make.two_patches()
    normal.requires_grad_()
    levels = [normal]
    for level, (conv, attention) in enumerate(zip(layer.convs, layer.attentions, strict=True)):
        edges = edge_index[:, rank < (2, 3)[level]]
        x = loops.edge_mlp_max(conv.mlp, levels[-1], levels[-1], edges, subtract=subtract and level > 0)
        levels.append(loops.channel_attention(attention, x, BATCH))
    x = torch.cat(levels, dim=1) @ layer.fuse.lins[0].weight.t() + layer.fuse.lins[0].bias
    norm = layer.fuse.norms[0].module
    mean, var = (x.mean(0), x.var(0, correction=0)) if training else (norm.running_mean, norm.running_var)
    expected = ((x - mean) / (var + norm.eps).sqrt() * norm.weight + norm.bias).clamp(min=0)
    expected_grads = make.gradients(expected, [normal, *layer.parameters()])
    out = layer(normal, edge_index, rank, BATCH)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    torch.testing.assert_close(make.gradients(out, [normal, *layer.parameters()]), expected_grads, rtol=0, atol=1e-10)


def test_edges_per_level(make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6)).eval()
    normal, edge_index, rank = make.two_patches()
    cut = edges_per_level(edge_index, rank, (2, 3))
    expected = layer(normal, edge_index, rank, BATCH)
    torch.testing.assert_close(layer(normal, cut, batch=BATCH), expected, rtol=0, atol=0)
    with pytest.raises(ValueError, match=r"each of 2 levels \(got 3\)"):
        layer(normal, [edge_index] * 3, batch=BATCH)
    with pytest.raises(ValueError, match=r"'edge_attr' of shape .* \(got None\)"):
        layer(normal, edge_index, batch=BATCH)


def test_reset_and_errors(make):
    layer = make.scramble(MultiScaleEmbedding((2, 3), (8, 16), 6))
    layer.reset_parameters()
    assert layer.fuse.norms[0].module.weight.tolist() == [1.0] * 6
    with pytest.raises(ValueError, match=r"equal length \(got \[2, 3\] and \[8\]\)"):
        MultiScaleEmbedding((2, 3), (8,))
    with pytest.raises(ValueError, match=r"\[num_faces, 3\] \(got \[4, 5\]\)"):
        layer(torch.randn(4, 5), torch.zeros(2, 1, dtype=torch.long), torch.zeros(1, dtype=torch.long))
