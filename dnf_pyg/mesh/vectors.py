"""Vectors in the rows of arrays, for compiled loops."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["set_unit", "square_distance"]

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def square_distance(vector: Floats, i: int, j: int) -> float:
    """Squared distance of two rows."""
    x, y, z = vector[i, 0] - vector[j, 0], vector[i, 1] - vector[j, 1], vector[i, 2] - vector[j, 2]
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def set_unit(out: Floats, i: int, x: float, y: float, z: float, otherwise: Floats) -> None:
    """Set a row to the direction of a vector, or to the row of ``otherwise`` where the vector is zero."""
    length = np.sqrt(x * x + y * y + z * z)
    if length > 0:
        out[i, 0], out[i, 1], out[i, 2] = x / length, y / length, z / length
    else:
        out[i] = otherwise[i]
