"""Polygon file format (ply), ascii and binary of both byte orders."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from dnf_pyg.io.formats.document import Document, Floats, Ints, fan
from dnf_pyg.io.formats.mtl import replace_name
from dnf_pyg.io.formats.normals import add_rows, area_vectors, moved_normals, turned_normals
from dnf_pyg.io.formats.ply_body import BinaryBody, Body, Change, TextBody
from dnf_pyg.io.formats.ply_header import Element, read_header
from dnf_pyg.io.formats.text import check_text

__all__ = ["PlyDocument"]

_POSITION = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_TEXTURE = re.compile(rb"^comment[ \t]+TextureFile[ \t]+(\S[^\r\n]*)\r*$", re.IGNORECASE | re.MULTILINE)
_CORNERS = ("vertex_indices", "vertex_index")


class PlyDocument(Document):
    r"""A ply file: ``x, y, z`` of its vertices move, ``nx, ny, nz`` follow them, all else stays.

    Examples:
        >>> header = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        >>> header += b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        >>> PlyDocument(header + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Path()).face.tolist()
        [[0, 1, 2]]
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        if data[:3] != b"ply":
            check_text(data[:1000])
        header = read_header(self.data)
        vertex = header.element("vertex")
        if vertex is None or any(vertex.column(name) is None for name in _POSITION):
            raise ValueError("it has no vertices with x, y and z")
        if any(
            row.length_type is not None or row.type.kind != "f" for row in vertex.properties if row.name in _POSITION
        ):
            raise ValueError("its x, y and z are not of type float or double")
        self.body: Body = BinaryBody(self.data, header) if header.byte_order else TextBody(self.data, header)
        self.pos = self.body.columns(vertex, _POSITION)
        self.header, self.vertex = header, vertex
        self.normal = self._normals(vertex)
        polygons, strips = self._lists("face"), self._lists("tristrips")
        self.count = polygons[0]
        self.face = np.concatenate([polygons[1][fan(self.count)], _strip_triangles(*strips)])

    def _lists(self, name: str) -> tuple[Ints, Ints]:
        """Lengths and vertices of the polygons or strips of an element; none if there is no such element."""
        element = self.header.element(name)
        column = None if element is None else element.column(*_CORNERS)
        if element is None or column is None or element.properties[column].length_type is None:
            return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
        return self.body.lists(element, column)

    def _normals(self, element: Element | None) -> Floats | None:
        """Stored normals of an element, (N, 3), if it has any that can be written back."""
        columns = [] if element is None else [element.column(name) for name in _NORMAL]
        if element is None or not columns or None in columns:
            return None
        types = [element.properties[column] for column in columns if column is not None]
        if any(described.length_type is not None or described.type.kind != "f" for described in types):
            return None
        return self.body.columns(element, _NORMAL)

    def property(self, name: str) -> Floats:
        """Single values of a property of the vertices or else the faces, (V,) or (F,).

        Raises:
            KeyError: If there is none of this name.
            ValueError: If it has a value per polygon, not all of which are triangles.
        """
        for element in (self.vertex, self.header.element("face")):
            column = None if element is None else element.column(name)
            if element is not None and column is not None and element.properties[column].length_type is None:
                if element is not self.vertex and element.num_rows != len(self.face):
                    raise ValueError(f"'{name}' belongs to polygons, of which not all are triangles")
                return self.body.columns(element, (name,))[:, 0]
        raise KeyError(name)

    @classmethod
    def place_companions(cls, data: bytes, folder: Path, place: Callable[[str], str]) -> bytes:
        """Replace the names of textures in comments of the header."""

        def replaced(found: re.Match[bytes]) -> bytes:
            name = found[1].rstrip().decode(errors="surrogateescape")
            return replace_name(found[0], name, place(name))

        end = data.find(b"end_header")
        return _TEXTURE.sub(replaced, data[:end]) + data[end:]

    def _rewritten(self, pos: Floats) -> bytes:
        changes = [Change(self.vertex, _POSITION, self.moved(pos), pos, self._used(pos))]
        if self.normal is not None and len(self.face):
            normal = moved_normals(self.normal, self.face, self.face, self.pos, pos)
            rows = np.flatnonzero((normal != self.normal).any(axis=1))
            changes.append(Change(self.vertex, _NORMAL, rows, normal, normal))
        element = self.header.element("face")
        stored = self._normals(element)
        if element is not None and stored is not None and len(self.count) == len(stored):
            triangles = self.face[: len(fan(self.count))]
            polygon = np.repeat(np.arange(len(stored)), np.maximum(self.count - 2, 0))
            sums = [add_rows(area_vectors(where, triangles), polygon, len(stored)) for where in (self.pos, pos)]
            normal = turned_normals(stored, *sums)
            rows = np.flatnonzero((normal != stored).any(axis=1))
            changes.append(Change(element, _NORMAL, rows, normal, normal))
        return self.body.replaced(changes)


def _strip_triangles(count: Ints, corner: Ints) -> Ints:
    """Triangles (F, 3) of strips, each of which -1 may interrupt; those that name a vertex twice only join others."""
    ends = np.insert(corner, np.cumsum(count), -1)
    first, second, third = ends[:-2], ends[1:-1], ends[2:]
    number = np.arange(len(first))
    start = np.maximum.accumulate(np.where(first < 0, number + 1, 0))
    triangles = np.stack([first, second, third], axis=1)
    triangles = np.where(((number - start) % 2 == 1)[:, None], triangles[:, [1, 0, 2]], triangles)
    whole = (triangles >= 0).all(axis=1)
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return triangles[whole & distinct]
