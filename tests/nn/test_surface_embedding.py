import pytest
import torch

from dnf_pyg.nn import SurfaceEmbedding

BATCH = torch.tensor([0] * 5 + [1] * 4)


@pytest.mark.parametrize("training", [False, True])
def test_every_level_sees_places(training, loops, make):
    """The reference lists the offset of each edge beside the features of its two faces."""
    layer = make.scramble(SurfaceEmbedding((2, 3), (8, 16), 6)).train(training)
    normal, edge_index, rank = make.two_patches()
    place, size = torch.randn(9, 3), torch.randn(9, 1)
    levels = [torch.cat([normal, size], dim=1)]
    for level, (conv, attention) in enumerate(zip(layer.convs, layer.attentions, strict=True)):
        neighbor, center = edge_index[:, rank < (2, 3)[level]]
        x = levels[-1]
        h = torch.cat([x[center], x[neighbor] - x[center], place[neighbor] - place[center]], dim=1)
        h = torch.stack(loops.mlp_on_rows(conv.mlp, h))
        h = torch.stack([h[center == i].amax(dim=0) for i in range(9)])
        levels.append(loops.channel_attention(attention, h, BATCH))
    x = torch.cat(levels, dim=1) @ layer.fuse.lins[0].weight.t() + layer.fuse.lins[0].bias
    expected = torch.stack(loops.normalize(x, layer.fuse.norms[0].module)).clamp(min=0)
    out = layer(torch.cat([levels[0], place], dim=1), edge_index, rank, BATCH)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)


def test_moves_of_the_patch_do_not_matter(make):
    layer = make.scramble(SurfaceEmbedding((2, 3), (8, 16), 6)).eval()
    normal, edge_index, rank = make.two_patches()
    x = torch.cat([normal, torch.randn(9, 4)], dim=1)
    moved = x + torch.tensor([0.0, 0, 0, 0, 3, -2, 5])
    expected = layer(x, edge_index, rank, BATCH)
    torch.testing.assert_close(layer(moved, edge_index, rank, BATCH), expected, rtol=0, atol=1e-9)


def test_rejects_other_columns():
    with pytest.raises(ValueError, match=r"\[num_faces, 7\] \(got \[4, 4\]\)"):
        SurfaceEmbedding((2,), (8,), 6)(torch.randn(4, 4), torch.zeros(2, 1, dtype=torch.long))
