"""Merge the copies of a vertex that texture seams and triangle soups have at one place."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

__all__ = ["WeldedMesh", "coincident_rows", "weld"]


class WeldedMesh(NamedTuple):
    """A mesh whose vertices are all distinct.

    Attributes:
        pos: Positions of the distinct vertices, (U, 3), in the order in which they first occur.
        face: Distinct vertices of each face, (3, F).
        vertex_id: Distinct vertex of each original vertex, (V,): ``pos[vertex_id]`` gives the positions of all copies.
    """

    pos: Tensor
    face: Tensor
    vertex_id: Tensor


def weld(pos: Tensor, face: Tensor) -> WeldedMesh:
    """Merge vertices whose coordinates are exactly equal; faces keep their number and order.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).

    Returns:
        The welded mesh, and the distinct vertex of each original one; a mesh without copies is returned unchanged.

    Examples:
        >>> soup = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        >>> welded = weld(soup, torch.arange(6).view(2, 3).t())
        >>> welded.face.t().tolist(), welded.vertex_id.tolist()
        ([[0, 1, 2], [1, 3, 2]], [0, 1, 2, 1, 3, 2])
        >>> torch.equal(welded.pos[welded.vertex_id], soup)
        True
    """
    vertex_id, first = coincident_rows(pos.detach().cpu().numpy())
    to_distinct = torch.from_numpy(vertex_id).to(face.device)
    return WeldedMesh(pos[torch.from_numpy(first).to(pos.device)], to_distinct[face], to_distinct)


def coincident_rows(rows: NDArray[np.floating]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the distinct rows (N, C) in the order in which they first occur.

    Returns:
        Number of each row, (N,), and the first row with each number, (U,).

    Examples:
        >>> coincident_rows(np.array([[0.0, 1.0], [2.0, 3.0], [-0.0, 1.0]]))
        (array([0, 1, 0]), array([0, 1]))
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    starts = np.ones(len(rows), dtype=bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    group = np.cumsum(starts) - 1  # of each row of ``ordered``
    first = order[starts]  # lexsort is stable, so the lowest row of each group
    by_occurrence = np.argsort(first)
    number = np.empty_like(by_occurrence)
    number[by_occurrence] = np.arange(len(first))
    row_number = np.empty(len(rows), dtype=np.int64)
    row_number[order] = number[group]
    return row_number, first[by_occurrence]
