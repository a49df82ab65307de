"""What the file formats share: a file in memory whose vertex positions can be replaced."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["Document", "Floats", "Ints", "UnsupportedError", "fan"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # of UTF-8, before the first character of a text file


class UnsupportedError(ValueError):
    """A file that is whole, but cannot be read.

    Args:
        reason: What stands in the way.
        remedy: What to do about it, a sentence.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.remedy = remedy


class Document(ABC):
    """A mesh file in memory.

    Constructors raise :class:`UnsupportedError`, or whatever damaged data leads to, if the bytes cannot be understood.

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
        self.data = data.removeprefix(_BYTE_ORDER_MARK)
        self.folder = folder
        self._mark = data[: len(data) - len(self.data)]
        self._placeless: NDArray[np.bool_] | slice = slice(0)

    def with_positions(self, pos: Floats) -> bytes:
        """Write the file with other positions (V, 3); lines and bytes of vertices that stay are kept as they are."""
        return self._mark + (self._rewritten(pos) if len(self.moved(pos)) else self.data)

    @abstractmethod
    def _rewritten(self, pos: Floats) -> bytes: ...

    @classmethod
    def place_companions(cls, data: bytes, folder: Path, place: Callable[[str], str]) -> bytes:
        """Replace the names of other files that a file of this format refers to.

        Args:
            data: The file.
            folder: Folder that the names are relative to.
            place: Gives the new name of a file; only the part after the last slash may differ.
        """
        return data

    def property(self, name: str) -> Floats:
        """Numbers of that name in the file, one per vertex or triangle.

        Raises:
            KeyError: If there are none.
            ValueError: If there is no single one per vertex or triangle.
        """
        raise KeyError(name)

    def moved(self, pos: Floats) -> Ints:
        """Vertices whose position differs from the file's, in rising order."""
        differs = (pos != self.pos).any(axis=1)
        differs[self._placeless] = False
        return np.flatnonzero(differs)

    def settle_unused(self, limit: float) -> None:
        """Give a position to vertices that no face uses and that have none; in the file they stay as they are.

        Args:
            limit: Largest absolute coordinate that counts as a position.
        """
        unused = np.ones(len(self.pos), dtype=bool)
        unused[self.face] = False
        self._placeless = unused & ~(np.abs(self.pos) <= limit).all(axis=1)
        self.pos[self._placeless] = self.pos[self.face[0, 0]]

    def _used(self, values: Floats) -> Floats:
        """Rows of those vertices that belong to a face."""
        used = np.zeros(len(values), dtype=bool)
        used[self.face] = True
        return values[used]


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
