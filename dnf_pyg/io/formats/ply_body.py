"""The tables of ply files, as text or as numbers of either byte order."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dnf_pyg.io.formats.document import Floats, Ints, number_text, replace_tokens
from dnf_pyg.io.formats.ply_header import Element, Header

__all__ = ["BinaryBody", "Body", "TextBody"]

Changes = Sequence[tuple[tuple[str, ...], Ints, Floats]]  # columns, rows that change, values of all rows


class Body(ABC):
    """The tables of a file, after its header."""

    @abstractmethod
    def columns(self, element: Element, names: tuple[str, ...]) -> Floats:
        """Single values by row, (N, C)."""

    @abstractmethod
    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""

    @abstractmethod
    def replaced(self, element: Element, changes: Changes) -> bytes:
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
        places = self._places(element, names)
        lines = (self.lines[row].split() for row in self.rows[element.name])
        return np.array([line[place] for line in lines for place in places], dtype=np.float64).reshape(-1, len(names))

    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""
        count, values = [], []
        for row in self.rows[element.name]:
            words = self.lines[row].split()
            place = 0
            for i, described in enumerate(element.properties):
                length = 1 if described.length_type is None else int(words[place])
                start = place + (described.length_type is not None)
                place = start + length
                if length < 0 or place > len(words):
                    raise ValueError(f"a row of '{element.name}' has fewer values than announced")
                if i == column:
                    count.append(length)
                    values += words[start:place]
        return np.array(count, dtype=np.int64), np.array(values, dtype=np.int64)

    def replaced(self, element: Element, changes: Changes) -> bytes:
        """The file with other values in some rows."""
        lines = list(self.lines)
        for names, changed, values in changes:
            places = self._places(element, names)
            for vertex, text in zip(changed.tolist(), number_text(values[changed], values), strict=True):
                row = self.rows[element.name][vertex]
                lines[row] = replace_tokens(lines[row], places, text)
        return self.header + b"\n".join(lines)

    @staticmethod
    def _places(element: Element, names: tuple[str, ...]) -> list[int]:
        columns = [element.column(name) for name in names]
        places = [column for column in columns if column is not None]
        if any(row.length_type is not None for row in element.properties[: max(places)]):
            raise ValueError(f"its '{element.name}' has a list before '{names[-1]}'")
        return places


class BinaryBody(Body):
    """Tables as numbers of fixed size."""

    def __init__(self, data: bytes, header: Header) -> None:
        self.data = data
        self.offset: dict[str, int] = {}
        self.table: dict[str, NDArray | None] = {}  # None where rows differ in length
        offset = header.length
        for element in header.elements:
            self.offset[element.name] = offset
            table = self._uniform(element, offset)
            self.table[element.name] = table
            offset = self._walk(element, offset, None)[2] if table is None else offset + table.nbytes

    def columns(self, element: Element, names: tuple[str, ...]) -> Floats:
        """Single values by row, (N, C)."""
        table = self._rows(element)
        return np.stack([table[name] for name in names], axis=1).astype(np.float64)

    def lists(self, element: Element, column: int) -> tuple[Ints, Ints]:
        """Length of each row's list (N,), and the values of all."""
        table = self.table[element.name]
        if table is None:
            return self._walk(element, self.offset[element.name], column)[:2]
        values = table[element.properties[column].name]
        return np.full(len(table), values.shape[1], dtype=np.int64), values.astype(np.int64).ravel()

    def replaced(self, element: Element, changes: Changes) -> bytes:
        """The file with other values in some rows."""
        data = bytearray(self.data)
        table = self._rows(element)
        table = np.frombuffer(data, table.dtype, len(table), self.offset[element.name])
        for names, changed, values in changes:
            for name, column in zip(names, values.T, strict=True):
                table[name][changed] = column[changed]
        return bytes(data)

    def _rows(self, element: Element) -> NDArray:
        table = self.table[element.name]
        if table is None:
            raise ValueError(f"its '{element.name}' has lists of different lengths")
        return table

    def _uniform(self, element: Element, offset: int) -> NDArray | None:
        """The whole table at once, if all rows have lists of the length of the first row's."""
        lengths: dict[str, int] = {}
        place = offset
        for name, type_, length_type in element.properties:
            if length_type is None or element.num_rows == 0:
                place += type_.itemsize
                lengths[name] = 0
            else:
                lengths[name] = int(np.frombuffer(self.data, length_type, 1, place)[0])
                place += length_type.itemsize + lengths[name] * type_.itemsize
        row_type = element.row_type(lengths)
        if offset + row_type.itemsize * element.num_rows > len(self.data):
            if any(length_type is not None for _, _, length_type in element.properties):
                return None
            raise ValueError(f"{element.num_rows} rows of '{element.name}' announced, it ends before")
        table = np.frombuffer(self.data, row_type, element.num_rows, offset)
        is_list = [name for name, _, length_type in element.properties if length_type is not None]
        return table if all((table[name + "#"] == lengths[name]).all() for name in is_list) else None

    def _walk(self, element: Element, offset: int, column: int | None) -> tuple[Ints, Ints, int]:
        """Read row by row: lengths and values of one list, and where the table ends."""
        counts, values = [], []
        view = memoryview(self.data)
        for _ in range(element.num_rows):
            for place, (_, type_, length_type) in enumerate(element.properties):
                length = 1
                if length_type is not None:
                    length = int(np.frombuffer(view, length_type, 1, offset)[0])
                    offset += length_type.itemsize
                end = offset + length * type_.itemsize
                if end > len(self.data):
                    raise ValueError(f"{element.num_rows} rows of '{element.name}' announced, it ends before")
                if place == column:
                    counts.append(length)
                    values.append(view[offset:end])
                offset = end
        if column is None:
            return np.empty(0, np.int64), np.empty(0, np.int64), offset
        joined = np.frombuffer(b"".join(values), element.properties[column].type).astype(np.int64)
        return np.array(counts, dtype=np.int64), joined, offset
