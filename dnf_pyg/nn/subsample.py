"""Fewer neighbours per face: a random choice while training, an even one to be faster."""

import torch
from torch import Tensor

__all__ = ["spread_neighbors", "subsample_neighbors"]


def subsample_neighbors(edge_index: Tensor, k: int, keep: int, generator: torch.Generator | None = None) -> Tensor:
    """Keep each centre itself and a random choice of its ``k`` nearest, the same ranks at every centre.

    The maximum over neighbours changes little when some are left out, and the cost falls with their number.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), sorted by centre, nearest first, itself before all, (2, E).
        k: Nearest edges of each centre to choose from.
        keep: Edges to keep of each centre that has ``k``, itself included.
        generator: Source of randomness.

    Returns:
        The kept edges, in their order.

    Raises:
        ValueError: If ``keep`` is not from 1 to ``k``.

    Example:
        >>> subsample_neighbors(torch.tensor([[0, 1, 2, 1, 0, 2], [0, 0, 0, 1, 1, 1]]), k=2, keep=1)
        tensor([[0, 1],
                [0, 1]])
    """
    if not 1 <= keep <= k:
        raise ValueError(f"Expected 'keep' from 1 to {k} (got {keep})")
    chosen = 1 + torch.randperm(k - 1, generator=generator)[: keep - 1]
    return _of_ranks(edge_index, torch.cat([chosen.new_zeros(1), chosen]))


def spread_neighbors(edge_index: Tensor, k: int, keep: int) -> Tensor:
    """Keep each centre itself and an even choice of its ``k`` nearest, from the nearest to the farthest.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), sorted by centre, nearest first, itself before all, (2, E).
        k: Nearest edges of each centre to choose from.
        keep: Edges to keep of each centre that has ``k``, itself included.

    Returns:
        The kept edges, in their order.

    Raises:
        ValueError: If ``keep`` is not from 1 to ``k``.

    Example:
        >>> spread_neighbors(torch.tensor([[0, 1, 2, 1, 0, 2], [0, 0, 0, 1, 1, 1]]), k=3, keep=2)
        tensor([[0, 2, 1, 2],
                [0, 0, 1, 1]])
    """
    if not 1 <= keep <= k:
        raise ValueError(f"Expected 'keep' from 1 to {k} (got {keep})")
    return _of_ranks(edge_index, torch.linspace(0, k - 1, keep).round().long())


def _of_ranks(edge_index: Tensor, ranks: Tensor) -> Tensor:
    """Edges at the given places within the run of their centre."""
    center = edge_index[1]
    count = torch.bincount(center)
    first = count.cumsum(0) - count
    rank = torch.arange(center.numel(), device=center.device) - first[center]
    chosen = torch.zeros(max(int(rank.max()) + 1 if rank.numel() else 1, int(ranks.max()) + 1), dtype=torch.bool)
    chosen[ranks] = True
    return edge_index[:, chosen.to(center.device)[rank]]
