import torch

from dnf_pyg.nn.kernels.fused import Scratch, edge_max
from dnf_pyg.nn.kernels.rows import Rows
from dnf_pyg.nn.neighbors import sort_by_center


def test_matches_loops(make, tiny_blocks):
    edge_index = make.random_edges([3, 2, 3, 1], 5)
    rows = Rows.from_sorted(sort_by_center(edge_index, (5, 4)))
    u, v = torch.randn(4, 6), torch.randn(5, 6)
    layers = [(torch.randn(7, 6), torch.randn(7)), (torch.randn(8, 7), torch.randn(8))]
    expected = []
    for i in rows.center.tolist():
        messages = []
        for j in edge_index[0, edge_index[1] == i].tolist():
            h = (u[i] + v[j]).clamp(min=0)
            for weight, bias in layers:
                h = (weight @ h + bias).clamp(min=0)
            messages.append(h)
        expected.append(torch.stack(messages).max(dim=0).values)
    torch.testing.assert_close(edge_max(rows.pick(u), v, rows, layers), torch.stack(expected), rtol=0, atol=1e-12)


def test_scratch_is_allocated_once():
    scratch = Scratch(torch.zeros(1), 8)
    assert scratch("a", 3, 2).data_ptr() == scratch("a", 8, 2).data_ptr() != scratch("b", 8, 2).data_ptr()
    assert scratch("c", 3, 2, torch.float32).dtype == torch.float32
