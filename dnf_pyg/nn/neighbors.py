"""Edges sorted by centre, limited to the nearest faces, or found in feature space."""

from collections.abc import Sequence
from typing import cast

import torch
from torch import Tensor
from torch_geometric import EdgeIndex
from torch_geometric.index import index2ptr
from torch_geometric.typing import Adj
from torch_geometric.utils import is_sparse, to_edge_index

__all__ = ["edges_per_level", "feature_neighbors", "nearest_edges", "patch_sizes", "sort_by_center"]


def sort_by_center(edge_index: Adj, size: tuple[int, int]) -> EdgeIndex:
    """Sort edges by their centre.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), shape (2, E), or a sparse matrix (centres by neighbours).
        size: Number of possible neighbours and number of centres.

    Returns:
        The edges, sorted by column, with their pointer (number of centres + 1,) in the cache.

    Example:
        >>> sort_by_center(torch.tensor([[1, 2, 0, 0], [0, 1, 0, 1]]), size=(3, 2)).tolist()
        [[1, 0, 2, 0], [0, 0, 1, 1]]
    """
    if is_sparse(edge_index):
        edge_index = to_edge_index(edge_index)[0].flip(0)
    if isinstance(edge_index, EdgeIndex):
        edge_index = edge_index.as_tensor()
    neighbor, center = edge_index
    if not bool((center[1:] >= center[:-1]).all()):
        center, order = center.sort(stable=True)
        neighbor = neighbor[order]
    out = EdgeIndex(torch.stack([neighbor, center]), sparse_size=size, sort_order="col")
    out._indptr = index2ptr(center, size[1])
    return out


def nearest_edges(edge_index: Tensor, edge_attr: Tensor | None, k: int) -> Tensor:
    """Keep the edges to the ``k`` nearest faces of each centre.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), in any order, shape (2, E).
        edge_attr: Rank of the neighbour among the nearest faces of its centre, 0 for the face itself, shape (E,).
        k: Neighbours to keep per centre. A centre with fewer keeps them all.

    Returns:
        The kept edges, in their order.

    Raises:
        ValueError: If ``edge_attr`` is not one rank per edge.

    Example:
        >>> edge_index, rank = torch.tensor([[0, 1, 1, 0], [0, 0, 1, 1]]), torch.tensor([0, 1, 0, 1])
        >>> nearest_edges(edge_index, rank, k=1).tolist()
        [[0, 1], [0, 1]]
    """
    if edge_attr is None or edge_attr.shape != edge_index.shape[1:]:
        got = None if edge_attr is None else list(edge_attr.shape)
        raise ValueError(
            f"Expected 'edge_attr' of shape [{edge_index.size(1)}], the rank of each neighbour (got {got}). Pass "
            "`data.edge_attr` of a patch."
        )
    return edge_index[:, edge_attr < k]


def edges_per_level(edge_index: Tensor | Sequence[Adj], edge_attr: Tensor | None, k: Sequence[int]) -> Sequence[Adj]:
    """Select the edges of each level: those to the ``k`` nearest faces, or the ones that are given level by level.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), shape (2, E), or a list with the edges of each level.
        edge_attr: Rank of each neighbour, shape (E,); ignored with a list of edges.
        k: Neighbours per face on each level.

    Raises:
        ValueError: If ``edge_attr`` does not fit ``edge_index``, or the list has another length than ``k``.

    Example:
        >>> edge_index, rank = torch.tensor([[0, 1], [0, 0]]), torch.tensor([0, 1])
        >>> [edges.tolist() for edges in edges_per_level(edge_index, rank, k=(1, 2))]
        [[[0], [0]], [[0, 1], [0, 0]]]
    """
    if isinstance(edge_index, list | tuple):
        if len(edge_index) != len(k):
            raise ValueError(
                f"Expected 'edge_index' for each of {len(k)} levels (got {len(edge_index)}). Give one for every level."
            )
        return edge_index
    tensor = cast("Tensor", edge_index)
    return [nearest_edges(tensor, edge_attr, k_level) for k_level in k]


def patch_sizes(batch: Tensor | None, num_nodes: int, batch_size: int | None = None) -> list[int]:
    """Count the nodes of each patch of a batch; one patch if ``batch`` is ``None``.

    Example:
        >>> patch_sizes(torch.tensor([0, 0, 1]), num_nodes=3)
        [2, 1]
    """
    if batch is None:
        return [num_nodes]
    return torch.bincount(batch, minlength=batch_size or 0).tolist()


@torch.no_grad()
def feature_neighbors(x: Tensor, k: int, batch: Tensor | None = None) -> Tensor:
    """Find the ``k`` nodes of the same patch that are nearest in feature space; a node is its own nearest.

    Args:
        x: Features, shape (N, C), patch after patch.
        k: Neighbours per node; a patch with fewer nodes gives all of its nodes.
        batch: Patch of each node, sorted, shape (N,); one patch if ``None``.

    Returns:
        Neighbour (row 0) to centre (row 1), sorted by centre, shape (2, sum over patches of n * min(k, n)).

    Example:
        >>> feature_neighbors(torch.tensor([[0.0], [1.0], [3.0]]), k=2).tolist()
        [[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]]
    """
    x = x.to(torch.promote_types(x.dtype, torch.float32))
    sizes = patch_sizes(batch, x.size(0))
    if batch is not None and min(sizes) <= k:
        return _with_small_patches(x, k, batch, torch.tensor(sizes, device=x.device))
    neighbor, center, start = [], [], 0
    for patch in x.split(sizes):
        size = patch.size(0)
        patch = patch - patch.mean(dim=0)  # smaller numbers lose fewer digits below
        with torch.autocast(x.device.type, enabled=False):
            distance = torch.addmm(patch.square().sum(dim=1), patch, patch.t(), alpha=-2)  # less the centre's square
        nearest = _smallest(distance, min(k, size))
        neighbor.append(nearest.flatten() + start)
        center.append(torch.arange(start, start + size, device=x.device).repeat_interleave(nearest.size(1)))
        start += size
    return torch.stack([torch.cat(neighbor), torch.cat(center)])


def _with_small_patches(x: Tensor, k: int, batch: Tensor, size: Tensor) -> Tensor:
    """Find the neighbours where some patches have at most ``k`` nodes: all nodes of each of these, without a loop.

    Args:
        x: Features, shape (N, C).
        k: Neighbours per node.
        batch: Patch of each node, sorted, shape (N,).
        size: Nodes of each patch, shape (P,).
    """
    width = size[batch]
    small, large = (width <= k).nonzero().flatten(), (width > k).nonzero().flatten()
    width = width[small]
    center = small.repeat_interleave(width)
    column = torch.arange(center.size(0), device=x.device) - (width.cumsum(0) - width).repeat_interleave(width)
    neighbor = (size.cumsum(0) - size)[batch[center]] + column
    nearest_first = (x[neighbor] - x[center]).square().sum(dim=1).argsort(stable=True)
    edge_index = torch.stack([neighbor, center])[:, nearest_first]
    if large.numel():
        patch = batch[large].unique_consecutive(return_inverse=True)[1]
        edge_index = torch.cat([edge_index, large[feature_neighbors(x[large], k, patch)]], dim=1)
    return edge_index[:, edge_index[1].argsort(stable=True)]


def _smallest(values: Tensor, k: int, num_groups: int = 100) -> Tensor:
    """Columns of the ``k`` smallest values of each row, smallest first.

    The ``k`` smallest lie in the ``k`` groups of columns with the smallest minima, so most columns need not be sorted.
    """
    columns = values.size(1)
    if k >= num_groups or columns % num_groups or columns < 4 * num_groups:
        return values.topk(k, largest=False).indices
    group = values.view(-1, columns // num_groups, num_groups).amin(dim=1).topk(k, largest=False, sorted=False).indices
    member = torch.arange(0, columns, num_groups, device=values.device).view(-1, 1)
    candidate = (group.unsqueeze(1) + member).flatten(1)  # (rows, k * columns / num_groups)
    return candidate.gather(1, values.gather(1, candidate).topk(k, largest=False).indices)
