"""Fewer neighbours per face: a random choice for training, an even one for speed."""

import torch
from torch import Generator, Tensor

__all__ = ["evenly_spaced_ranks", "random_ranks", "select_ranks"]


def random_ranks(k: int, count: int, generator: Generator | None = None) -> Tensor:
    """Draw ranks below ``k`` at random; rank 0, the face itself, is always among them.

    A max over neighbours changes little when some are left out, and the cost falls with their number.

    Args:
        k: Number of ranks to choose from.
        count: Number of ranks to draw, from 1 to ``k``.
        generator: Source of randomness.

    Returns:
        The ranks, shape (count,).

    Raises:
        ValueError: If ``count`` is not from 1 to ``k``.

    Example:
        >>> random_ranks(k=5, count=1)
        tensor([0])
    """
    _check(k, count)
    return torch.cat([torch.zeros(1, dtype=torch.long), 1 + torch.randperm(k - 1, generator=generator)[: count - 1]])


def evenly_spaced_ranks(k: int, count: int) -> Tensor:
    """Choose ranks below ``k`` at even distances, from the face itself to the farthest neighbour.

    Args:
        k: Number of ranks to choose from.
        count: Number of ranks to choose, from 1 to ``k``.

    Returns:
        The ranks, shape (count,).

    Raises:
        ValueError: If ``count`` is not from 1 to ``k``.

    Example:
        >>> evenly_spaced_ranks(k=5, count=3)
        tensor([0, 2, 4])
    """
    _check(k, count)
    return torch.linspace(0, k - 1, count).round().long()


def select_ranks(edge_index: Tensor, edge_attr: Tensor, ranks: Tensor) -> Tensor:
    """Keep the edges to neighbours of the given ranks.

    Args:
        edge_index: Neighbour (row 0) to centre (row 1), in any order, shape (2, E).
        edge_attr: Rank of the neighbour among the nearest faces of its centre, shape (E,).
        ranks: Ranks to keep.

    Returns:
        The kept edges, in their order.

    Example:
        >>> edge_index, rank = torch.tensor([[0, 1, 2, 1, 0, 2], [0, 0, 0, 1, 1, 1]]), torch.tensor([0, 1, 2, 0, 1, 2])
        >>> select_ranks(edge_index, rank, torch.tensor([0, 2]))
        tensor([[0, 2, 1, 2],
                [0, 0, 1, 1]])
    """
    beyond = int(ranks.max()) + 1
    kept = edge_attr.new_zeros(beyond + 1, dtype=torch.bool)
    kept[ranks] = True  # a lookup takes a third of the time of torch.isin
    return edge_index.index_select(1, kept[edge_attr.clamp(max=beyond)].nonzero().squeeze(1))


def _check(k: int, count: int) -> None:
    if not 1 <= count <= k:
        raise ValueError(f"Expected 'count' from 1 to {k} (got {count}). Keep at most as many neighbours as there are.")
