"""Object file format (off), as text."""

from pathlib import Path

import numpy as np

from dnf_pyg.io.formats.document import Document, Floats, fan, number_text, replace_tokens

__all__ = ["OffDocument"]


class OffDocument(Document):
    r"""An off file as text, also with colours or texture coordinates (``COFF``, ``STOFF``).

    Examples:
        >>> OffDocument(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Path()).face.tolist()
        [[0, 1, 2]]
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        self.lines = data.split(b"\n")
        plain = [line.split(b"#", 1)[0] for line in self.lines] if b"#" in data else self.lines
        rows = [row for row, line in enumerate(plain) if line and not line.isspace()]
        header = plain[rows[0]].split()
        keyword = b""
        if not header[0].lstrip(b"-").isdigit():
            keyword, header = header[0].upper(), header[1:]
            rows = rows if header else rows[1:]
            header = header or plain[rows[0]].split()
        if keyword not in (b"", b"OFF", b"COFF", b"STOFF", b"CSTOFF", b"STCOFF") or header[:1] == [b"BINARY"]:
            raise ValueError(f"an off file as text with plain vertices is needed, this one begins with {keyword!r}")
        num_vertices, num_faces = int(header[0]), int(header[1])
        if min(num_vertices, num_faces) < 0 or len(rows) < 1 + num_vertices + num_faces:
            raise ValueError(f"{num_vertices} vertices and {num_faces} faces announced, {len(rows) - 1} lines found")
        self.vertex_rows = rows[1 : 1 + num_vertices]
        numbers = [word for row in self.vertex_rows for word in plain[row].split()[:3]]
        self.pos = np.array(numbers, dtype=np.float64).reshape(num_vertices, 3)
        polygons = [plain[row] for row in rows[1 + num_vertices : 1 + num_vertices + num_faces]]
        count = np.array([line.split(None, 1)[0] for line in polygons], dtype=np.int64)
        sizes = count.tolist()
        corners = [word for line, size in zip(polygons, sizes, strict=True) for word in line.split()[1 : 1 + size]]
        if len(corners) != count.sum():
            raise ValueError("a face has fewer corners than announced")
        self.face = np.array(corners, dtype=np.int64)[fan(count)]

    def _rewritten(self, pos: Floats) -> bytes:
        lines = list(self.lines)
        moved = self.moved(pos)
        for vertex, text in zip(moved.tolist(), number_text(pos[moved], pos), strict=True):
            row = self.vertex_rows[vertex]
            lines[row] = replace_tokens(lines[row], (0, 1, 2), text)
        return b"\n".join(lines)
