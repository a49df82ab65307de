"""Pairs of faces that meet at an edge."""

import torch
from torch import Tensor

from dnf_pyg.mesh.adjacency import edge_adjacent

__all__ = ["hinges"]


def hinges(face: Tensor) -> tuple[Tensor, Tensor]:
    """List the pairs of faces with exactly two vertices in common, each pair once.

    Args:
        face: Vertices of each face, (3, F).

    Returns:
        ``(pair, vertex)``: faces i < j of each pair, (2, E), and the vertices around them, (4, E): the two ends of the
        edge, then the vertex opposite in i and the one opposite in j.

    Example:
        >>> hinges(torch.tensor([[0, 1], [1, 3], [2, 2]]))
        (tensor([[0],
                [1]]), tensor([[1],
                [2],
                [0],
                [3]]))
    """
    pair = edge_adjacent(face)
    pair = pair[:, pair[0] < pair[1]]
    first, second = face[:, pair[0]], face[:, pair[1]]  # (3, E)
    same = first[:, None] == second[None]  # (3, 3, E)
    alone, alone_too = ~same.any(dim=1), ~same.any(dim=0)  # corners that the other face does not have
    simple = (alone.sum(dim=0) == 1) & (alone_too.sum(dim=0) == 1)
    apex, apex_too = (mask[:, simple].long().argmax(dim=0) for mask in (alone, alone_too))
    around = torch.stack([(apex + 1) % 3, (apex + 2) % 3, apex])
    vertex = torch.cat([first[:, simple].gather(0, around), second[:, simple].gather(0, apex_too[None])])
    return pair[:, simple], vertex
