"""Faces with one winding, and one face where several have the same vertices."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from torch import Tensor

from dnf_pyg.mesh.adjacency import opposite_half_edges
from dnf_pyg.mesh.weld import coincident_rows

__all__ = ["ConsistentFaces", "consistent_faces"]

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


class ConsistentFaces(NamedTuple):
    """Distinct faces that are wound like their neighbours.

    Attributes:
        face: Vertices of each distinct face, (3, D), in the order in which they first occur.
        face_id: Distinct face of each original face, (F,).
        sign: -1 for original faces that are wound the other way than their distinct one, else 1, (F,) float32: a
            normal of the distinct face times the sign is that of the original.
        num_turned: Number of faces that were turned to be wound like their neighbours.
        num_doubled: Number of faces that have the same vertices as an earlier one.
    """

    face: Tensor
    face_id: Tensor
    sign: Tensor
    num_turned: int
    num_doubled: int


def consistent_faces(face: Tensor) -> ConsistentFaces:
    """Turn faces so that neighbours are wound alike, and keep one of those with the same vertices.

    In each part of a mesh that is connected by edges with two faces, the winding of most faces is kept. A part that
    has no such winding, like a Moebius strip, stays as it is.

    Args:
        face: Vertices of each face, (3, F), of a welded mesh.

    Returns:
        Distinct faces, and how the original ones follow from them; sound faces are returned unchanged.

    Example:
        >>> found = consistent_faces(torch.tensor([[0, 1], [1, 2], [2, 3]]))  # both go along their edge from 1 to 2
        >>> found.face.t().tolist(), found.sign.tolist()
        ([[0, 1, 2], [1, 3, 2]], [1.0, -1.0])
    """
    corner = face.cpu().numpy()
    number, first = coincident_rows(np.sort(corner, axis=0).T)
    distinct = corner[:, first]
    turned = _turned(distinct)
    distinct[:, turned] = distinct[:, turned][[0, 2, 1]]
    sign = np.where(_is_odd(corner) == _is_odd(distinct)[number], 1.0, -1.0).astype(np.float32)
    to_face, face_id, signs = (torch.from_numpy(value).to(face.device) for value in (distinct, number, sign))
    return ConsistentFaces(to_face, face_id, signs, int(turned.sum()), len(number) - len(first))


def _is_odd(face: Ints) -> Flags:
    """Whether the vertices of each face, from the lowest on, come in descending order, (F,) bool."""
    lowest = face.argmin(axis=0)
    row = np.arange(face.shape[1])
    return face[(lowest + 1) % 3, row] > face[(lowest + 2) % 3, row]


def _turned(face: Ints) -> Flags:
    """Mark the faces that are wound the other way than most of their part, (F,) bool.

    Every face is taken twice, as it is and turned; neighbours are linked in the windings that agree. The two copies
    of a part are then apart, unless it has no winding.
    """
    num = face.shape[1]
    start = face.ravel()
    one, two = opposite_half_edges(face)
    alike = start[one] != start[two]  # neighbours go along their edge in opposite directions
    if alike.all():
        return np.zeros(num, dtype=bool)
    a, b = one % num, two % num
    other = np.where(alike, b, b + num)
    link = np.concatenate([a, a + num]), np.concatenate([other, (other + num) % (2 * num)])
    graph = coo_array((np.ones(2 * len(a), dtype=np.int8), link), shape=(2 * num, 2 * num))
    label = connected_components(graph, directed=False)[1].reshape(2, num)
    mirrored = label[0] > label[1]
    part = label.min(axis=0)
    size, reversed_size = np.bincount(part), np.bincount(part, weights=mirrored)
    minority = np.where((2 * reversed_size > size)[part], ~mirrored, mirrored)
    return minority & (label[0] != label[1])
