"""Fewer neighbours per face while training."""

import torch
from torch import Tensor

__all__ = ["subsample_neighbors"]


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
    center = edge_index[1]
    count = torch.bincount(center)
    first = count.cumsum(0) - count
    rank = torch.arange(center.numel(), device=center.device) - first[center]
    chosen = torch.zeros(max(int(rank.max()) + 1 if rank.numel() else 1, k), dtype=torch.bool)
    chosen[0] = True
    chosen[1 + torch.randperm(k - 1, generator=generator)[: keep - 1]] = True
    return edge_index[:, chosen.to(center.device)[rank]]
