import pytest
import torch

from dnf_pyg.nn import spread_neighbors, subsample_neighbors


def rows(edge_index, num_nodes):
    return [edge_index[0, edge_index[1] == center].tolist() for center in range(num_nodes)]


def test_keeps_self_and_chosen_ranks_of_the_nearest():
    center = torch.arange(20).repeat_interleave(9)
    edge_index = torch.stack([torch.arange(180) % 20, center])
    kept = rows(subsample_neighbors(edge_index, k=6, keep=4, generator=torch.Generator().manual_seed(0)), 20)
    ranks = [[row.index(value) for value in left] for row, left in zip(rows(edge_index, 20), kept, strict=True)]
    assert all(rank == ranks[0] for rank in ranks)
    assert ranks[0][0] == 0
    assert len(ranks[0]) == 4
    assert max(ranks[0]) < 6


def test_every_rank_is_chosen_equally_often():
    edge_index = torch.stack([torch.arange(5), torch.zeros(5, dtype=torch.long)])
    generator = torch.Generator().manual_seed(0)
    kept = torch.cat([subsample_neighbors(edge_index, 5, 3, generator)[0] for _ in range(4000)])
    share = torch.bincount(kept, minlength=5) / 4000
    torch.testing.assert_close(share, torch.tensor([1.0, 0.5, 0.5, 0.5, 0.5]), atol=0.03, rtol=0)


def test_short_rows_keep_what_was_chosen_of_them():
    edge_index = torch.tensor([[0, 1, 2, 1], [0, 0, 0, 1]])
    assert rows(subsample_neighbors(edge_index, k=3, keep=3), 2) == [[0, 1, 2], [1]]


def test_rejects_more_than_there_are():
    with pytest.raises(ValueError, match=r"from 1 to 3 \(got 4\)"):
        subsample_neighbors(torch.zeros(2, 1, dtype=torch.long), k=3, keep=4)


def test_spread_takes_ranks_evenly():
    edge_index = torch.stack([torch.arange(12), torch.tensor([0] * 7 + [1] * 5)])  # the second centre has fewer
    assert spread_neighbors(edge_index, k=7, keep=4)[0].tolist() == [0, 2, 4, 6, 7, 9, 11]
    assert torch.equal(spread_neighbors(edge_index, k=7, keep=7), edge_index)
    with pytest.raises(ValueError, match="'keep' from 1 to 7"):
        spread_neighbors(edge_index, k=7, keep=8)
