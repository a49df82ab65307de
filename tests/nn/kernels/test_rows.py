import pytest
import torch

from dnf_pyg.nn.kernels.rows import Rows
from dnf_pyg.nn.neighbors import sort_by_center


@pytest.mark.parametrize("degrees", [[2, 2, 2], [3, 0, 1, 3], [0, 0], [5]])
def test_rows_and_blocks_cover_each_edge_once(degrees, make, tiny_blocks):
    edge_index = make.random_edges(degrees, 6)
    rows = Rows.from_sorted(sort_by_center(edge_index, (6, len(degrees))))
    centers = torch.arange(len(degrees)) if rows.center is None else rows.center
    assert rows.num_edges == sum(degrees)
    found = []
    for block in rows.blocks(width=40):
        assert block.num_edges == block.degree * (block.rows.stop - block.rows.start) <= rows.block_size(40)
        owner = centers[block.rows].repeat_interleave(block.degree)
        found += list(zip(rows.source[block.edges].tolist(), owner.tolist(), strict=True))
    assert sorted(found) == sorted(map(tuple, edge_index.t().tolist()))


def test_pick_and_spread(make):
    rows = Rows.from_sorted(sort_by_center(make.random_edges([1, 0, 2], 3), (3, 3)))
    x = torch.randn(3, 2)
    assert rows.degree().tolist() == [1, 2]
    assert rows.spread(rows.pick(x)).tolist() == [x[0].tolist(), [0.0, 0.0], x[2].tolist()]
