"""Object file format (off), as text."""

import re
from pathlib import Path

import numpy as np

from dnf_pyg.io.formats.document import Document, Floats, fan
from dnf_pyg.io.formats.normals import moved_normals
from dnf_pyg.io.formats.text import check_text, number_text, parse_numbers, replace_tokens

__all__ = ["OffDocument"]

_KEYWORD = re.compile(rb"(?!(?-i:nOFF))((?:ST|C|N)*)OFF", re.IGNORECASE)  # numbers may follow without a blank


class OffDocument(Document):
    r"""An off file as text, also with normals, colours or texture coordinates (``NOFF``, ``COFF``, ``STOFF``).

    Examples:
        >>> OffDocument(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Path()).face.tolist()
        [[0, 1, 2]]
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        check_text(data)
        self.lines = self.data.split(b"\n")
        plain = [line.split(b"#", 1)[0] for line in self.lines] if b"#" in data else self.lines
        rows = [row for row, line in enumerate(plain) if line and not line.isspace()]
        keyword, header = self._split_keyword(plain[rows[0]])
        if not header:
            rows = rows[1:]
            header = plain[rows[0]].split()
        num_vertices, num_faces = int(header[0]), int(header[1])
        if min(num_vertices, num_faces) < 0 or len(rows) < 1 + num_vertices + num_faces:
            raise ValueError(f"{num_vertices} vertices and {num_faces} faces announced, {len(rows) - 1} lines found")
        self.vertex_rows = rows[1 : 1 + num_vertices]
        columns = 6 if b"N" in keyword else 3
        numbers = [word for row in self.vertex_rows for word in plain[row].split()[:columns]]
        if len(numbers) != num_vertices * columns:
            raise ValueError(f"a vertex has fewer than {columns} numbers")
        values = parse_numbers(numbers, columns)
        self.pos, self.normal = values[:, :3], values[:, 3:]
        self._own = numbers[: 3 * 1000]
        polygons = [plain[row] for row in rows[1 + num_vertices : 1 + num_vertices + num_faces]]
        count = np.array([line.split(None, 1)[0] for line in polygons], dtype=np.int64)
        sizes = count.tolist()
        corners = [word for line, size in zip(polygons, sizes, strict=True) for word in line.split()[1 : 1 + size]]
        if not 0 <= count.min(initial=0) <= count.max(initial=0) <= len(corners) == count.sum():
            raise ValueError("a face has fewer corners than announced")
        self.face = np.array(corners, dtype=np.int64)[fan(count)]

    def _rewritten(self, pos: Floats) -> bytes:
        lines = list(self.lines)
        changes = [((0, 1, 2), self.moved(pos), pos, self._used(pos), self._own)]
        if self.normal.size:
            normal = moved_normals(self.normal, self.face, self.face, self.pos, pos)
            changes.append(((3, 4, 5), np.flatnonzero((normal != self.normal).any(axis=1)), normal, normal, []))
        for columns, changed, values, used, own in changes:
            for vertex, text in zip(changed.tolist(), number_text(values[changed], used, own), strict=True):
                row = self.vertex_rows[vertex]
                lines[row] = replace_tokens(lines[row], columns, text)
        return b"\n".join(lines)

    @staticmethod
    def _split_keyword(line: bytes) -> tuple[bytes, list[bytes]]:
        """Letters before ``OFF`` on the first line, if it has the keyword, and the words after it."""
        first, *words = line.split()
        found = _KEYWORD.match(first)
        if (found is None and not first.lstrip(b"-").isdigit()) or words[:1] == [b"BINARY"]:
            raise ValueError(f"an off file as text with plain vertices is needed, this one begins with {first!r}")
        rest = first[found.end() :] if found else first
        return (found[1].upper() if found else b""), [rest, *words] if rest else words
