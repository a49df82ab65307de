"""What the file formats share: a file in memory whose vertex positions can be replaced."""

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dnf_pyg.mesh.weld import coincident_rows

__all__ = ["Document", "fan", "moved_normals", "number_text", "replace_tokens"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SEPARATOR = re.compile(rb"((?:\s|\\\r?\n)+)")


class Document(ABC):
    """A mesh file in memory.

    Constructors raise ``ValueError``, or whatever damaged data leads to, if the bytes cannot be understood.

    Args:
        data: The file's bytes.
        folder: Where it lies, for the files that it refers to.

    Attributes:
        pos: Vertex positions, (V, 3), in the file's order and units.
        face: Vertices of each triangle, (F, 3); polygons are split into fans, in order.
    """

    pos: Floats
    face: Ints

    def __init__(self, data: bytes, folder: Path) -> None:
        self.data = data
        self.folder = folder

    def with_positions(self, pos: Floats) -> bytes:
        """Write the file with other positions (V, 3); lines and bytes of vertices that stay are kept as they are."""
        return self._rewritten(pos) if len(self.moved(pos)) else self.data

    @abstractmethod
    def _rewritten(self, pos: Floats) -> bytes: ...

    def companions(self) -> list[str]:
        """Names of other files that this one refers to, relative to its folder."""
        return []

    def property(self, name: str) -> Floats:
        """Numbers of that name in the file, one per vertex or triangle.

        Raises:
            KeyError: If there are none.
            ValueError: If there is no single one per vertex or triangle.
        """
        raise KeyError(name)

    def moved(self, pos: Floats) -> Ints:
        """Vertices whose position differs from the file's, in rising order."""
        return np.flatnonzero((pos != self.pos).any(axis=1))


def fan(count: Ints) -> Ints:
    """Split polygons into triangles.

    Args:
        count: Corners of each polygon, (P,).

    Returns:
        Corners of each triangle, (F, 3), counted over all polygons; fewer than three corners make no triangle.

    Examples:
        >>> fan(np.array([3, 4])).tolist()
        [[0, 1, 2], [3, 4, 5], [3, 5, 6]]
    """
    start = np.cumsum(count) - count
    triangles = np.maximum(count - 2, 0)
    first = np.repeat(start, triangles)
    step = np.arange(triangles.sum()) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def moved_normals(normal: Floats, corner_normal: Ints, face: Ints, pos: Floats, new_pos: Floats) -> Floats:
    """Recompute the normals that a file stores after its vertices have moved.

    Faces share a normal where the file lets them: at the same place with the same stored normal, also across the seam
    of a texture. Hard edges thus stay hard, flat shading flat, and smooth shading smooth.

    Args:
        normal: Stored normals, (M, 3).
        corner_normal: Stored normal of each corner of each triangle, (F, 3).
        face: Vertices of each triangle, (F, 3).
        pos: Positions in the file, (V, 3).
        new_pos: New positions, (V, 3).

    Returns:
        Normals, (M, 3): area weighted and of unit length where a face around has moved, else the stored ones.
    """
    place = coincident_rows(pos)[0][face]
    value = coincident_rows(normal)[0][corner_normal]
    _, group = np.unique(place * (value.max(initial=0) + 1) + value, return_inverse=True)
    sums = []
    for where in (pos, new_pos):
        a, b, c = where[face].transpose(1, 0, 2)
        by_face = np.repeat(np.cross(b - a, c - a), 3, axis=0)  # (3 F, 3), twice the area long
        sums.append(_add_rows(_add_rows(by_face, group.ravel())[group.ravel()], corner_normal.ravel(), len(normal)))
    before, after = sums
    sign = np.where((before * normal).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)  # normals that point inwards stay so
    length = np.linalg.norm(after, axis=1, keepdims=True)
    changed = (before != after).any(axis=1, keepdims=True) & (length > 0)
    return np.where(changed, sign * after / np.where(length > 0, length, 1.0), normal)


def _add_rows(rows: Floats, index: Ints, size: int | None = None) -> Floats:
    """Sum rows (N, 3) that have the same index (N,)."""
    size = int(index.max(initial=-1)) + 1 if size is None else size
    return np.stack([np.bincount(index, rows[:, axis], size) for axis in range(3)], axis=1)


def number_text(values: Floats, like: Floats) -> list[list[bytes]]:
    """Write numbers (N, C) as text, fine enough to resolve 1e-9 of the extent of ``like`` (V, C).

    Examples:
        >>> number_text(np.array([[0.5, 1 / 3]]), np.array([[0.0, 0.0], [100.0, 100.0]]))
        [[b'0.50000000', b'0.33333333']]
    """
    extent = float(np.ptp(like, axis=0).max(initial=0.0)) or float(np.abs(like).max(initial=0.0)) or 1.0
    decimals = int(np.clip(10 - np.ceil(np.log10(extent)), 0, 300))
    return [[b"%.*f" % (decimals, value) for value in row] for row in values.tolist()]


def replace_tokens(line: bytes, columns: Sequence[int], values: Sequence[bytes]) -> bytes:
    """Replace words of a line and keep its spacing.

    Examples:
        >>> replace_tokens(b"v  1 2 3 # tip", (1, 2, 3), (b"7", b"8", b"9"))
        b'v  7 8 9 # tip'
    """
    words = line.split(b" ")
    if b"" not in words and not line.count(b"\t") and not line.count(b"\r") and not line.count(b"\\"):  # the usual line
        for column, value in zip(columns, values, strict=True):
            words[column] = value
        return b" ".join(words)
    parts = _SEPARATOR.split(line)
    indent = 2 if parts[0] == b"" else 0
    for column, value in zip(columns, values, strict=True):
        parts[2 * column + indent] = value
    return b"".join(parts)
