"""Edges of each centre in one run: sorted, cut to the nearest ones, or found in feature space."""

import torch
from torch import Tensor
from torch_geometric import EdgeIndex
from torch_geometric.index import index2ptr
from torch_geometric.typing import Adj
from torch_geometric.utils import is_sparse, to_edge_index

__all__ = ["feature_neighbors", "first_of_equal_rows", "patch_sizes", "sort_by_center"]


def sort_by_center(edge_index: Adj, size: tuple[int, int], k: int | None = None) -> EdgeIndex:
    """Bring edges into runs of equal centre, and keep the first ``k`` of each run.

    Within a run the order given stays, so that edges listed nearest first keep the nearest.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), shape (2, E), or a sparse matrix (centres by neighbours).
        size: Number of neighbours to choose from and number of centres.
        k: Edges to keep per centre; all if ``None``. A shorter run stays whole.

    Returns:
        The edges, sorted by column, with their pointer (number of centres + 1,) in the cache.

    Example:
        >>> edge_index = torch.tensor([[1, 2, 0, 0], [0, 1, 0, 1]])
        >>> sort_by_center(edge_index, size=(3, 2), k=1).tolist()
        [[1, 2], [0, 1]]
    """
    if is_sparse(edge_index):
        edge_index = to_edge_index(edge_index)[0].flip(0)
    if isinstance(edge_index, EdgeIndex):
        edge_index = edge_index.as_tensor()
    neighbor, center = edge_index
    if not bool((center[1:] >= center[:-1]).all()):
        center, order = center.sort(stable=True)
        neighbor = neighbor[order]
    ptr = index2ptr(center, size[1])
    degree = ptr.diff()
    if k is not None and bool((degree > k).any()):
        keep = torch.arange(center.numel(), device=center.device) - ptr[center] < k
        neighbor, center = neighbor[keep], center[keep]
        ptr = torch.cat([ptr[:1], degree.clamp(max=k).cumsum(0)])
    out = EdgeIndex(torch.stack([neighbor, center]), sparse_size=size, sort_order="col")
    out._indptr = ptr
    return out


def first_of_equal_rows(edge_index: Tensor, num_centers: int, k: int | None = None) -> Tensor:
    """Keep the first ``k`` edges of each centre where all centres have equally many, without looking at the values.

    Args:
        edge_index: Edges sorted by centre, the same number for each, shape (2, num_centers * K).
        num_centers: Number of centres.
        k: Edges to keep per centre; all if ``None``.

    Returns:
        The kept edges, shape (2, num_centers * min(k, K)).

    Example:
        >>> first_of_equal_rows(torch.tensor([[0, 1, 1, 0], [0, 0, 1, 1]]), num_centers=2, k=1).tolist()
        [[0, 1], [0, 1]]
    """
    if k is None:
        return edge_index
    rows = edge_index.view(2, num_centers, edge_index.size(1) // num_centers)
    return rows[:, :, :k].reshape(2, -1)


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
    neighbor, center, start = [], [], 0
    for patch in x.to(torch.promote_types(x.dtype, torch.float32)).split(patch_sizes(batch, x.size(0))):
        size = patch.size(0)
        patch = patch - patch.mean(dim=0)  # smaller numbers lose fewer digits below
        with torch.autocast(x.device.type, enabled=False):
            distance = torch.addmm(patch.square().sum(dim=1), patch, patch.t(), alpha=-2)  # less the centre's square
        nearest = _smallest(distance, min(k, size))
        neighbor.append(nearest.flatten() + start)
        center.append(torch.arange(start, start + size, device=x.device).repeat_interleave(nearest.size(1)))
        start += size
    return torch.stack([torch.cat(neighbor), torch.cat(center)])


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
