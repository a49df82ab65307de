"""Merge the copies of a vertex that texture seams and triangle soups have at one place."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from torch import Tensor

__all__ = ["WeldedMesh", "coincident_rows", "weld"]

_RELATIVE = 1e-4  # of the length of an edge, within which its ends are one with those of another
_LAST_PLACES = 8  # of the coordinates as float32: a few operations on them
_LARGEST = 0.01  # of the shortest edge there, so that no face collapses
_FOLD = 0.996  # cosine of 5 degrees: faces closer than that lie on each other
_NEAREST = 6  # open edges among which the partner of one is looked for, itself included


class WeldedMesh(NamedTuple):
    """A mesh without cracks between copies of a vertex.

    Attributes:
        pos: Positions of the distinct vertices, (U, 3), in the order in which they first occur.
        face: Distinct vertices of each face, (3, F).
        vertex_id: Distinct vertex of each original vertex, (V,): ``pos[vertex_id]`` gives all copies one position.
    """

    pos: Tensor
    face: Tensor
    vertex_id: Tensor


def weld(pos: Tensor, face: Tensor) -> WeldedMesh:
    """Merge vertices that are one up to the precision of their coordinates; faces keep their number and order.

    Vertices with equal coordinates are merged first. A crack that is left has an open edge on either side: open edges
    are merged if they are the nearest to each other, their ends agree within a tolerance, and the faces continue each
    other. Faces that lie on each other, such as those of two thin sheets, stay apart however close they are. The
    tolerance is 1e-4 times the length of the edge, or eight units in the last place of the coordinates as float32 if
    that is more, but no more than a hundredth of the shortest edge there.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).

    Returns:
        The welded mesh, and the distinct vertex of each original one; a mesh without copies is returned unchanged.

    Examples:
        >>> soup = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 1e-7], [1, 1, 0], [0, 1, 0]])
        >>> welded = weld(soup, torch.arange(6).view(2, 3).t())
        >>> welded.face.t().tolist(), welded.vertex_id.tolist()
        ([[0, 1, 2], [1, 3, 2]], [0, 1, 2, 1, 3, 2])
    """
    rows = pos.detach().cpu().numpy()
    vertex_id, first = coincident_rows(rows)
    merged, kept = coincident_rows(_without_cracks(rows[first].astype(np.float64), vertex_id[face.cpu().numpy()]))
    to_distinct = torch.from_numpy(merged[vertex_id]).to(face.device)
    return WeldedMesh(pos[torch.from_numpy(first[kept]).to(pos.device)], to_distinct[face], to_distinct)


def _without_cracks(pos: NDArray[np.float64], face: NDArray[np.int64]) -> NDArray[np.int64]:
    """Label the vertices (V, 3): those on the two sides of a crack get the same label, (V, 1)."""
    start, end, third = _open_edges(pos, face)
    if len(start) < 2:
        return np.arange(len(pos))[:, None]
    tolerance = _tolerance(pos, face, start, end)
    middle = (pos[start] + pos[end]) / 2
    from scipy.spatial import KDTree  # takes a while to import

    nearest = KDTree(middle).query(middle, list(range(1, _NEAREST + 1)), distance_upper_bound=1.01 * tolerance.max())
    near = np.asarray(nearest[1])
    one, column = np.nonzero(near < len(start))
    two = near[one, column]
    along = _unit(pos[end] - pos[start])
    inward = pos[third] - pos[start]
    inward = _unit(inward - (inward * along).sum(axis=1, keepdims=True) * along)
    turned = (along[one] * along[two]).sum(axis=1) < 0  # neighbours of the same orientation go along it in turn
    first, last = np.where(turned, end[two], start[two]), np.where(turned, start[two], end[two])
    gap = np.maximum(_distance(pos, start[one], first), _distance(pos, end[one], last))
    joins = (
        (one != two)
        & (gap <= np.minimum(tolerance[one], tolerance[two]))
        & ((inward[one] * inward[two]).sum(axis=1) < _FOLD)
    )
    one, two, first, last, gap = (value[joins] for value in (one, two, first, last, gap))
    order = np.lexsort((two, gap, one))
    _, leading = np.unique(one[order], return_index=True)
    best = np.full(len(start), -1)
    best[one[order[leading]]] = two[order[leading]]
    mutual = (best[one] == two) & (best[two] == one)
    ends = np.stack([np.concatenate([start[one], end[one]]), np.concatenate([first, last])])[:, np.tile(mutual, 2)]
    graph = coo_array((np.ones(ends.shape[1]), tuple(ends)), shape=(len(pos), len(pos)))
    return connected_components(graph, directed=False)[1].astype(np.int64)[:, None]


def _open_edges(pos: NDArray[np.float64], face: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Start, end and third vertex of the edges that have one face, each (U,); none without length."""
    start, end, third = (np.roll(face, -turn, axis=0).ravel() for turn in range(3))
    code = np.minimum(start, end) * len(pos) + np.maximum(start, end)
    _, row, count = np.unique(code, return_index=True, return_counts=True)
    single = row[(count == 1) & (start[row] != end[row])]
    return [value[single] for value in (start, end, third)]


def _tolerance(
    pos: NDArray[np.float64], face: NDArray[np.int64], start: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Distance up to which the ends of edges (U,) are one with those of another, (U,), model units."""
    one, two = face.ravel(), np.roll(face, -1, axis=0).ravel()
    length = _distance(pos, one, two)
    length[length == 0] = np.inf
    shortest = np.full(len(pos), np.inf)
    for vertex in (one, two):
        np.minimum.at(shortest, vertex, length)
    last_place = float(np.spacing(np.float32(np.abs(pos[one]).max())))
    wanted = np.maximum(_RELATIVE * _distance(pos, start, end), _LAST_PLACES * last_place)
    return np.minimum(wanted, _LARGEST * np.minimum(shortest[start], shortest[end]))


def _distance(pos: NDArray[np.float64], one: NDArray[np.int64], two: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.linalg.norm(pos[one] - pos[two], axis=1)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-300)


def coincident_rows(rows: NDArray[np.number]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
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
