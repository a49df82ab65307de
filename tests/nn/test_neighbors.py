import pytest
import torch
from torch_geometric import EdgeIndex
from torch_geometric.utils import to_torch_coo_tensor, to_torch_csr_tensor

from dnf_pyg.nn.neighbors import feature_neighbors, first_of_equal_rows, sort_by_center

SHUFFLED = torch.tensor([[3, 1, 0, 2, 2], [1, 0, 1, 1, 3]])  # centre 2 has none


ALL = [[1, 3, 0, 2, 2], [0, 1, 1, 1, 3]]


@pytest.mark.parametrize(("k", "expected"), [(None, ALL), (2, [[1, 3, 0, 2], [0, 1, 1, 3]]), (9, ALL)])
def test_sorts_and_keeps_the_first(k, expected):
    out = sort_by_center(SHUFFLED, (4, 4), k)
    assert out.tolist() == expected
    assert out.is_sorted_by_col
    assert out.get_csc()[0][0].tolist() == [sum(c < i for c in expected[1]) for i in range(5)]


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


def test_equal_rows_without_looking():
    edge_index = torch.stack([torch.arange(12), torch.arange(4).repeat_interleave(3)])
    assert first_of_equal_rows(edge_index, 4, 2).tolist() == sort_by_center(edge_index, (12, 4), 2).tolist()
    assert first_of_equal_rows(edge_index, 4) is edge_index
    assert first_of_equal_rows(edge_index, 4, 9).tolist() == edge_index.tolist()


@pytest.mark.parametrize("sizes", [[12], [7, 7], [3, 9, 1]])
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
