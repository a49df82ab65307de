import copy

import pytest
import torch
from torch_geometric.nn import MLP

from dnf_pyg.nn.kernels.edge_mlp import folded_edge_max, normalized_edge_max
from dnf_pyg.nn.kernels.rows import Rows
from dnf_pyg.nn.neighbors import sort_by_center

DEGREES = [3, 2, 3, 2]


@pytest.fixture
def graph(make):
    return Rows.from_sorted(sort_by_center(make.random_edges(DEGREES, 5), (5, 4)))


def plain(mlp, u, v, rows):
    """Edge by edge with the modules of the MLP themselves."""
    center = torch.arange(4).repeat_interleave(rows.degree())
    h = mlp.norms[0](u[center] + v[rows.source]).relu()
    for lin, norm in zip(mlp.lins[1:], mlp.norms[1:], strict=True):
        h = norm(lin(h)).relu()
    return torch.stack([h[center == i].amax(dim=0) for i in range(4)])


@pytest.mark.parametrize("momentum", [0.1, None])
@pytest.mark.parametrize("training", [False, True])
def test_equals_the_modules(graph, momentum, training, make):
    mlp = make.scramble(MLP([12, 6, 7, 8], plain_last=False, norm_kwargs={"momentum": momentum})).train(training)
    other, run = copy.deepcopy(mlp), normalized_edge_max if training else folded_edge_max
    for _ in range(3):
        u, v = torch.randn(4, 6), torch.randn(5, 6)
        with torch.no_grad():
            torch.testing.assert_close(run(mlp, u, v, graph), plain(other, u, v, graph), rtol=0, atol=1e-12)
    torch.testing.assert_close(dict(mlp.named_buffers()), dict(other.named_buffers()), rtol=0, atol=1e-12)


def test_large_offsets_do_not_spoil_single_precision(graph, make):
    """Statistics of numbers far from zero."""
    mlp = make.scramble(MLP([12, 6, 7, 8], plain_last=False))
    u, v = torch.randn(4, 6) + 500, torch.randn(5, 6) - 400
    expected = normalized_edge_max(mlp, u, v, graph)
    out = normalized_edge_max(copy.deepcopy(mlp).float(), u.float(), v.float(), graph)
    torch.testing.assert_close(out.double(), expected, rtol=0, atol=2e-3)
