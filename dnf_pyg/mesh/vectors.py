"""Vectors in the rows of arrays, for compiled loops."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["difference_along", "set_unit", "square_distance", "tangent_axes"]

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


@njit(cache=True, nogil=True)
def tangent_axes(normal: Floats, i: int) -> tuple[Floats, Floats]:
    """Two unit vectors, each (3,), orthogonal to a unit normal and to each other. Source: Duff et al. 2017."""
    x, y, z = normal[i, 0], normal[i, 1], normal[i, 2]
    sign = 1.0 if z >= 0 else -1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.array([1.0 + sign * x * x * a, sign * b, -sign * x]), np.array([b, sign + y * y * a, -y])


@njit(cache=True, nogil=True)
def difference_along(axis: Floats, vector: Floats, i: int, j: int) -> float:
    """Component along an axis of the difference of two rows, from i to j."""
    x, y, z = vector[j, 0] - vector[i, 0], vector[j, 1] - vector[i, 1], vector[j, 2] - vector[i, 2]
    return axis[0] * x + axis[1] * y + axis[2] * z
