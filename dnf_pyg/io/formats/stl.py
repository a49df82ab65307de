"""Stereolithography (stl) files, binary and ascii: triangles that share no vertices."""

import re
from pathlib import Path

import numpy as np

from dnf_pyg.io.formats.document import Document, Floats, UnsupportedError
from dnf_pyg.io.formats.text import check_text, number_text, parse_numbers

__all__ = ["StlDocument"]

_HEADER = 84  # bytes: 80 of text, 4 of count
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET = re.compile(rb"(facet\s+normal\s+)(\S+\s+\S+\s+\S+)|(vertex\s+)(\S+\s+\S+\s+\S+)", re.IGNORECASE)


class StlDocument(Document):
    r"""An stl file; header, colours (the attribute of a triangle) and names stay, facet normals follow.

    Examples:
        >>> data = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        >>> StlDocument(data + b"endloop\nendfacet\nendsolid a\n", Path()).face.tolist()
        [[0, 1, 2]]
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        announced = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else -1
        self.is_binary = announced >= 0 and len(data) >= _HEADER + announced * _TRIANGLE.itemsize
        if self.is_binary and data[:5].lower() == b"solid" and b"endsolid" in data[-400:]:
            self.is_binary = False
        if self.is_binary:
            self.data, self._mark = data, b""  # bytes of a header, no byte-order mark
            following = (len(data) - _HEADER) // _TRIANGLE.itemsize
            if announced == 0 and following:
                raise UnsupportedError(
                    f"its header announces 0 triangles, but {following} follow", "Write their number into its header."
                )
            triangles = np.frombuffer(data, _TRIANGLE, announced, _HEADER)
            with np.errstate(invalid="ignore"):  # signalling NaN in a damaged file
                self.pos = triangles["corner"].reshape(-1, 3).astype(np.float64)
        elif self.data.lstrip()[:5].lower() == b"solid":
            words = [word for found in _FACET.finditer(data) if found[4] for word in found[4].split()]
            self.pos = parse_numbers(words, 3)
            self._own = words[:3000]
            if b"endsolid" not in data[-400:].lower() or len(self.pos) % 3:
                raise ValueError("the text ends in the middle")
        else:
            check_text(data)
            raise ValueError(f"{announced} triangles announced, {len(data)} bytes found")
        self.face = np.arange(len(self.pos), dtype=np.int64).reshape(-1, 3)

    def _rewritten(self, pos: Floats) -> bytes:
        changed = np.unique(self.moved(pos) // 3)  # triangles
        corner = pos.reshape(-1, 3, 3)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal /= np.where(length > 0, length, 1.0)
        if self.is_binary:
            data = bytearray(self.data)
            triangles = np.frombuffer(data, _TRIANGLE, len(corner), _HEADER)
            triangles["normal"][changed] = normal[changed]
            triangles["corner"][changed] = corner[changed]
            return bytes(data)
        return self._rewritten_text(set(changed.tolist()), normal, pos)

    def _rewritten_text(self, changed: set[int], normal: Floats, pos: Floats) -> bytes:
        normal_text = number_text(normal, normal)
        corner_text = number_text(pos, pos, self._own)
        vertex, facet = -1, -1

        def rewrite(found: re.Match[bytes]) -> bytes:
            nonlocal vertex, facet
            if found[1]:
                facet += 1
                return found[1] + b" ".join(normal_text[facet]) if facet in changed else found[0]
            vertex += 1
            return found[3] + b" ".join(corner_text[vertex]) if vertex // 3 in changed else found[0]

        return _FACET.sub(rewrite, self.data)
