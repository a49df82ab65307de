"""How far pairs of adjacent faces are from a plane."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dnf_pyg.mesh.adjacency import opposite_half_edges

__all__ = ["PairDeviations", "pair_deviations"]


class PairDeviations(NamedTuple):
    """Deviation of pairs of faces from a plane.

    Attributes:
        deviation: Standard deviation of white noise that explains each, (P,), model units: noise of that standard
            deviation on a plane gives half-normal values of it.
        pair: Rows of the two faces of each pair, (2, P).
    """

    deviation: NDArray[np.float64]
    pair: NDArray[np.int64]


def pair_deviations(pos: NDArray[np.float64], face: NDArray[np.int64]) -> PairDeviations:
    """Measure every two faces that share an edge with no third.

    The lines through the shared edge and through the opposite vertices of a pair would meet in a plane. Their
    distance is linear in the four vertices, with weights that follow from the points where the lines are closest.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).

    Example:
        >>> pos = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.02]])
        >>> deviation, pair = pair_deviations(pos, np.array([[0, 0], [1, 2], [2, 3]]))
        >>> deviation.round(4).tolist(), pair.ravel().tolist()
        ([0.01], [1, 0])
    """
    start, end, opposite = (np.roll(face, -turn, axis=0).ravel() for turn in range(3))
    one, two = opposite_half_edges(face)
    a, b, c, d = pos[start[one]], pos[end[one]], pos[opposite[one]], pos[opposite[two]]
    across = np.cross(b - a, d - c)
    squared = np.maximum((across**2).sum(axis=1), 1e-300)
    distance = np.abs(((c - a) * across).sum(axis=1)) / np.sqrt(squared)
    along = (np.cross(c - a, d - c) * across).sum(axis=1) / squared  # where the lines are closest: a + along (b - a)
    between = (np.cross(c - a, b - a) * across).sum(axis=1) / squared  # and c + between (d - c)
    weight = np.sqrt((1 - along) ** 2 + along**2 + (1 - between) ** 2 + between**2)
    return PairDeviations(distance / weight, np.stack([one, two]) % face.shape[1])
