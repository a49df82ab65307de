"""Polygon file format (ply), ascii and binary of both byte orders."""

from pathlib import Path

import numpy as np

from dnf_pyg.io.formats.document import Document, Floats, Ints, fan, moved_normals
from dnf_pyg.io.formats.ply_body import BinaryBody, Body, TextBody
from dnf_pyg.io.formats.ply_header import read_header

__all__ = ["PlyDocument"]

_POSITION = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
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
        header = read_header(data)
        vertex = header.element("vertex")
        if vertex is None or any(vertex.column(name) is None for name in _POSITION):
            raise ValueError("it has no vertices with x, y and z")
        if any(
            row.length_type is not None or row.type.kind != "f" for row in vertex.properties if row.name in _POSITION
        ):
            raise ValueError("its x, y and z are not of type float or double")
        self.body: Body = BinaryBody(data, header) if header.byte_order else TextBody(data, header)
        self.pos = self.body.columns(vertex, _POSITION)
        has_normal = all(vertex.column(name) is not None for name in _NORMAL)
        self.normal = self.body.columns(vertex, _NORMAL) if has_normal else None
        self.header, self.vertex = header, vertex
        face = header.element("face")
        column = None if face is None else face.column(*_CORNERS)
        self.face = np.empty((0, 3), dtype=np.int64)
        if face is not None and column is not None and face.properties[column].length_type is not None:
            count, corner = self.body.lists(face, column)
            self.face = corner[fan(count)]

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

    def _rewritten(self, pos: Floats) -> bytes:
        changes: list[tuple[tuple[str, ...], Ints, Floats]] = [(_POSITION, self.moved(pos), pos)]
        if self.normal is not None and len(self.face):
            normal = moved_normals(self.normal, self.face, self.face, self.pos, pos)
            changes += [(_NORMAL, np.flatnonzero((normal != self.normal).any(axis=1)), normal)]
        return self.body.replaced(self.vertex, changes)
