"""The faces that are seen at the pixels of an image."""

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["nearest_face"]


@numba.njit(cache=True)
def nearest_face(
    pixel: NDArray[np.float64], face: NDArray[np.int64], size: int
) -> NDArray[np.int32]:  # pragma: no cover
    """Find the face that is seen at each pixel of a square image.

    Args:
        pixel: Column, row and nearness of each vertex, shape (V, 3); pixel (r, c) has its centre at (c + 0.5, r + 0.5).
        face: Vertices of each face, shape (F, 3).
        size: Pixels per side.

    Returns:
        Row of the face with the largest nearness at the centre of each pixel, shape (size, size); -1 without a face.

    Example:
        >>> corner = np.array([[0.0, 0, 1], [2, 0, 1], [0, 2, 1]])
        >>> nearest_face(corner, np.array([[0, 1, 2]]), 2).tolist()
        [[0, 0], [0, -1]]
    """
    face_id = np.full((size, size), -1, dtype=np.int32)
    depth = np.full((size, size), -np.inf)
    for f in range(face.shape[0]):
        ax, ay, az = pixel[face[f, 0]]
        bx, by, bz = pixel[face[f, 1]]
        cx, cy, cz = pixel[face[f, 2]]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        first_row, last_row = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)), size - 1)
        first_column, last_column = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)), size - 1)
        for row in range(first_row, last_row + 1):
            y = row + 0.5
            for column in range(first_column, last_column + 1):
                x = column + 0.5
                v = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                if v < 0 or w < 0 or v + w > 1:
                    continue
                z = az + v * (bz - az) + w * (cz - az)
                if z > depth[row, column]:
                    depth[row, column] = z
                    face_id[row, column] = f
    return face_id
