import pytest
import torch
from torch_geometric import EdgeIndex
from torch_geometric.utils import to_torch_coo_tensor, to_torch_csr_tensor

from dnf_pyg.nn.neighbors import edges_per_level, feature_neighbors, nearest_edges, sort_by_center

SHUFFLED = torch.tensor([[3, 1, 0, 2, 2], [1, 0, 1, 1, 3]])  # centre 2 has none


def test_sorts_by_centre():
    out = sort_by_center(SHUFFLED, (4, 4))
    assert out.tolist() == [[1, 3, 0, 2, 2], [0, 1, 1, 1, 3]]
    assert out.is_sorted_by_col
    assert out.get_csc()[0][0].tolist() == [0, 1, 4, 4, 5]


def test_other_forms_of_edges():
    expected = sort_by_center(SHUFFLED, (4, 4)).tolist()
    assert sort_by_center(EdgeIndex(SHUFFLED, sparse_size=(4, 4)), (4, 4)).tolist() == expected
    by_neighbor = [[1, 0, 2, 3, 2], [0, 1, 1, 1, 3]]  # a matrix has its columns in order
    for to_sparse in (to_torch_coo_tensor, to_torch_csr_tensor):
        assert sort_by_center(to_sparse(SHUFFLED.flip(0), size=(4, 4)), (4, 4)).tolist() == by_neighbor


def test_bipartite_size_and_no_edges():
    out = sort_by_center(torch.zeros(2, 0, dtype=torch.long), (5, 2))
    assert out.sparse_size() == (5, 2)
    assert out.get_csc()[0][0].tolist() == [0, 0, 0]


def test_nearest_edges_follow_the_ranks_in_any_order():
    rank = torch.tensor([0, 0, 2, 1, 0])
    assert nearest_edges(SHUFFLED, rank, 1).tolist() == [[3, 1, 2], [1, 0, 3]]
    order = torch.tensor([4, 2, 0, 3, 1])
    kept = nearest_edges(SHUFFLED[:, order], rank[order], 2)
    assert sorted(kept.t().tolist()) == sorted(nearest_edges(SHUFFLED, rank, 2).t().tolist())
    for wrong in (None, rank[:3]):
        with pytest.raises(ValueError, match=r"'edge_attr' of shape \[5\], the rank of each neighbour \(got"):
            nearest_edges(SHUFFLED, wrong, 1)


def test_edges_of_each_level():
    rank = torch.tensor([0, 0, 2, 1, 0])
    levels = edges_per_level(SHUFFLED, rank, k=(1, 3))
    assert [edges.size(1) for edges in levels] == [3, 5]
    assert edges_per_level(levels, None, k=(1, 3)) is levels
    with pytest.raises(ValueError, match=r"each of 3 levels \(got 2\)"):
        edges_per_level(levels, None, k=(1, 2, 3))


@pytest.mark.parametrize("sizes", [[12], [7, 7], [3, 9, 1], [1, 1, 2], [5, 1, 4, 3, 30, 2, 5]])
def test_nearest_in_feature_space(sizes, loops):
    x = torch.randn(sum(sizes), 6)
    batch = torch.arange(len(sizes)).repeat_interleave(torch.tensor(sizes))
    out = feature_neighbors(x, 4, batch)
    assert out.tolist() == loops.nearest_in_features(x, 4, batch).tolist()
    if len(sizes) == 1:
        assert feature_neighbors(x, 4).tolist() == out.tolist()


def test_nearest_far_from_the_origin(loops):
    """Distances are small differences of large numbers unless features are centred first."""
    x = (torch.rand(40, 3) + 1e3).float()
    batch = torch.zeros(40, dtype=torch.long)
    assert feature_neighbors(x, 5).tolist() == loops.nearest_in_features(x.double(), 5, batch).tolist()


def test_nearest_of_a_whole_patch():
    """Patches of the usual size sort a part of their columns only."""
    x = torch.randn(800, 8)
    distance = torch.cdist(x, x)
    expected = distance.topk(20, largest=False).values
    out = feature_neighbors(x, 20)[0].view(800, 20)
    torch.testing.assert_close(distance.gather(1, out), expected, rtol=0, atol=1e-7)
