"""The tables of ply files, as text or as numbers of either byte order."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dnf_pyg.io.formats.document import Floats, Ints
from dnf_pyg.io.formats.ply_header import Element, Header
from dnf_pyg.io.formats.text import number_text, parse_numbers, replace_tokens

__all__ = ["BinaryBody", "Body", "Change", "TextBody"]


class Change(NamedTuple):
    """New values in some rows of a table.

    Attributes:
        element: The table.
        names: Its columns that change.
        rows: The rows that change, (R,).
        values: Values of all rows, (N, C).
        used: Values whose extent decides how many digits are written, (M, C).
    """

    element: Element
    names: tuple[str, ...]
    rows: Ints
    values: Floats
    used: Floats


class Body(ABC):
    """The tables of a file, after its header."""

    @abstractmethod
    def columns(self, element: Element, names: tuple[str, ...]) -> Floats:
        """Single values by row, (N, C)."""

    @abstractmethod
    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""

    @abstractmethod
    def replaced(self, changes: Sequence[Change]) -> bytes:
        """The file with other values in some rows."""


class TextBody(Body):
    """Tables as text, a line per row."""

    def __init__(self, data: bytes, header: Header) -> None:
        self.header = data[: header.length]
        self.lines = data[header.length :].split(b"\n")
        rows = [row for row, line in enumerate(self.lines) if line and not line.isspace()]
        self.rows: dict[str, list[int]] = {}
        for element in header.elements:
            self.rows[element.name], rows = rows[: element.num_rows], rows[element.num_rows :]
            if len(self.rows[element.name]) < element.num_rows:
                raise ValueError(f"{element.num_rows} rows of '{element.name}' announced, it ends before")

    def columns(self, element: Element, names: tuple[str, ...]) -> Floats:
        """Single values by row, (N, C)."""
        rows = range(len(self.rows[element.name]))
        words = [word for row in rows for word in self._words(element, names, row)]
        return parse_numbers(words, len(names))

    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""
        count, values = [], []
        for row in self.rows[element.name]:
            words = self.lines[row].split()
            start, end = _spans(element, words)[column]
            count.append(end - start)
            values += words[start:end]
        return np.array(count, dtype=np.int64), np.array(values, dtype=np.int64)

    def replaced(self, changes: Sequence[Change]) -> bytes:
        """The file with other values in some rows."""
        lines = list(self.lines)
        for element, names, changed, values, used in changes:
            rows = self.rows[element.name]
            sample = range(0, len(rows), max(1, len(rows) // 1000))
            own = [word for row in sample for word in self._words(element, names, row)]
            for number, text in zip(changed.tolist(), number_text(values[changed], used, own), strict=True):
                row = rows[number]
                lines[row] = replace_tokens(lines[row], self._places(element, names, lines[row].split()), text)
        return self.header + b"\n".join(lines)

    def _words(self, element: Element, names: tuple[str, ...], row: int) -> list[bytes]:
        words = self.lines[self.rows[element.name][row]].split()
        return [words[place] for place in self._places(element, names, words)]

    @staticmethod
    def _places(element: Element, names: tuple[str, ...], words: list[bytes]) -> list[int]:
        columns = [column for name in names if (column := element.column(name)) is not None]
        if not element.has_lists:
            return columns
        spans = _spans(element, words)
        return [spans[column][0] for column in columns]


def _spans(element: Element, words: list[bytes]) -> list[tuple[int, int]]:
    """Where the values of each column begin and end in a row of text."""
    spans = []
    end = 0
    for described in element.properties:
        is_list = described.length_type is not None
        length = int(words[end]) if is_list else 1
        start = end + is_list
        end = start + length
        if length < 0 or end > len(words):
            raise ValueError(f"a row of '{element.name}' has fewer values than announced")
        spans.append((start, end))
    return spans


class BinaryBody(Body):
    """Tables as numbers of fixed size."""

    def __init__(self, data: bytes, header: Header) -> None:
        self.data = data
        self.tables: dict[str, tuple[int, NDArray]] = {}  # where a table with equal rows begins, and the table
        self.ragged: dict[str, tuple[Ints, Ints]] = {}  # bytes where values begin, and their number, (N, C), of others
        offset = header.length
        for element in header.elements:
            table = self._table(element, offset)
            if table is None:
                places, lengths, offset = self._walk(element, offset)
                self.ragged[element.name] = places, lengths
            else:
                self.tables[element.name] = offset, table
                offset += table.nbytes

    def columns(self, element: Element, names: tuple[str, ...]) -> Floats:
        """Single values by row, (N, C)."""
        if element.name in self.tables:
            table = self.tables[element.name][1]
            return np.stack([table[name] for name in names], axis=1).astype(np.float64)
        return np.stack([self._ragged_values(element, name) for name in names], axis=1).astype(np.float64)

    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""
        name = element.properties[column].name
        if element.name in self.tables:
            values = self.tables[element.name][1][name]
            return np.full(len(values), values.shape[1], dtype=np.int64), values.astype(np.int64).ravel()
        return self.ragged[element.name][1][:, column], self._ragged_values(element, name).astype(np.int64)

    def replaced(self, changes: Sequence[Change]) -> bytes:
        """The file with other values in some rows."""
        data = bytearray(self.data)
        for element, names, changed, values, _ in changes:
            for name, column in zip(names, values[changed].T, strict=True):
                if element.name in self.tables:
                    offset, table = self.tables[element.name]
                    np.frombuffer(data, table.dtype, len(table), offset)[name][changed] = column
                else:
                    index, type_ = self._ragged_bytes(element, name, changed)
                    np.frombuffer(data, np.uint8)[index] = column.astype(type_).view(np.uint8).reshape(index.shape)
        return bytes(data)

    def _ragged_values(self, element: Element, name: str) -> NDArray:
        index, type_ = self._ragged_bytes(element, name, np.arange(element.num_rows))
        return np.frombuffer(self.data, np.uint8)[index].reshape(-1).view(type_)

    def _ragged_bytes(self, element: Element, name: str, rows: Ints) -> tuple[Ints, np.dtype]:
        """Bytes (M, size) of the values of a column in some rows, those of a list after each other, and their type."""
        column = next(i for i, described in enumerate(element.properties) if described.name == name)
        type_ = element.properties[column].type
        place, length = (part[rows, column] for part in self.ragged[element.name])
        within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        start = np.repeat(place, length) + within * type_.itemsize
        return start[:, None] + np.arange(type_.itemsize), type_

    def _table(self, element: Element, offset: int) -> NDArray | None:
        """The whole table at once, if all rows have lists of the length of the first row's."""
        lengths: dict[str, int] = {}
        place = offset
        for name, type_, length_type in element.properties:
            if length_type is None or element.num_rows == 0:
                place += type_.itemsize
                lengths[name] = 0
            else:
                lengths[name] = self._length(length_type, place)
                place += length_type.itemsize + lengths[name] * type_.itemsize
        if place - offset > len(self.data):
            raise ValueError(f"a row of '{element.name}' has more values than the file")
        row_type = element.row_type(lengths)
        if offset + row_type.itemsize * element.num_rows > len(self.data):
            if element.has_lists:
                return None
            raise ValueError(f"{element.num_rows} rows of '{element.name}' announced, it ends before")
        table = np.frombuffer(self.data, row_type, element.num_rows, offset)
        is_list = [name for name, _, length_type in element.properties if length_type is not None]
        return table if all((table[name + "#"] == lengths[name]).all() for name in is_list) else None

    def _walk(self, element: Element, offset: int) -> tuple[Ints, Ints, int]:
        """Go through a table row by row: places and lengths of its values, (N, C), and where it ends."""
        places, lengths = [], []
        for _ in range(element.num_rows):
            for _, type_, length_type in element.properties:
                length = 1
                if length_type is not None:
                    length = self._length(length_type, offset)
                    offset += length_type.itemsize
                places.append(offset)
                lengths.append(length)
                offset += length * type_.itemsize
            if offset > len(self.data):
                raise ValueError(f"{element.num_rows} rows of '{element.name}' announced, it ends before")
        shape = (element.num_rows, len(element.properties))
        return np.array(places, np.int64).reshape(shape), np.array(lengths, np.int64).reshape(shape), offset

    def _length(self, type_: np.dtype, offset: int) -> int:
        if offset + type_.itemsize > len(self.data):
            raise ValueError("it ends within a list")
        length = int(np.frombuffer(self.data, type_, 1, offset)[0])
        if length < 0:
            raise ValueError(f"a list of {length} values announced")
        return length
