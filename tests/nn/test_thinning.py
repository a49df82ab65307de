import pytest
import torch

from dnf_pyg.nn.thinning import evenly_spaced_ranks, random_ranks, select_ranks


def test_random_ranks_hold_the_face_itself():
    ranks = random_ranks(k=6, count=4, generator=torch.Generator().manual_seed(0))
    assert ranks[0] == 0
    assert len(set(ranks.tolist())) == 4
    assert ranks.max() < 6


def test_every_rank_is_chosen_equally_often():
    generator = torch.Generator().manual_seed(0)
    drawn = torch.cat([random_ranks(5, 3, generator) for _ in range(4000)])
    share = torch.bincount(drawn, minlength=5) / 4000
    torch.testing.assert_close(share, torch.tensor([1.0, 0.5, 0.5, 0.5, 0.5]), atol=0.03, rtol=0, check_dtype=False)


def test_even_ranks_reach_from_the_face_itself_to_the_farthest():
    assert evenly_spaced_ranks(k=7, count=4).tolist() == [0, 2, 4, 6]
    assert evenly_spaced_ranks(k=7, count=7).tolist() == list(range(7))


def test_selects_edges_by_rank_in_any_order():
    edge_index, rank = torch.tensor([[0, 1, 2, 1, 4], [0, 0, 0, 1, 1]]), torch.tensor([0, 1, 2, 0, 1])
    order = torch.tensor([3, 1, 4, 0, 2])
    kept = select_ranks(edge_index[:, order], rank[order], torch.tensor([0, 2]))
    assert kept.tolist() == [[1, 0, 2], [1, 0, 0]]
    assert select_ranks(edge_index, rank, torch.tensor([5])).shape == (2, 0)
    assert select_ranks(edge_index[:, :0], rank[:0], torch.tensor([0])).shape == (2, 0)


@pytest.mark.parametrize("choose", [random_ranks, evenly_spaced_ranks])
@pytest.mark.parametrize("count", [0, 4])
def test_rejects_other_counts(choose, count):
    with pytest.raises(ValueError, match=rf"'count' from 1 to 3 \(got {count}\)"):
        choose(3, count)
