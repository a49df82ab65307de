"""Mesh file formats: each reads positions and triangles and writes the file back with other positions.

All else in a file stays as it is: order, polygons, texture coordinates, materials, colours, attributes, comments.
"""

import struct

from dnf_pyg.io.formats.document import Document
from dnf_pyg.io.formats.glb import GlbDocument
from dnf_pyg.io.formats.gltf import GltfDocument
from dnf_pyg.io.formats.obj import ObjDocument
from dnf_pyg.io.formats.off import OffDocument
from dnf_pyg.io.formats.ply import PlyDocument
from dnf_pyg.io.formats.stl import StlDocument

__all__ = [
    "DAMAGE",
    "DOCUMENTS",
    "Document",
    "GlbDocument",
    "GltfDocument",
    "ObjDocument",
    "OffDocument",
    "PlyDocument",
    "StlDocument",
]

DOCUMENTS: dict[str, type[Document]] = {
    ".obj": ObjDocument,
    ".ply": PlyDocument,
    ".stl": StlDocument,
    ".off": OffDocument,
    ".glb": GlbDocument,
    ".gltf": GltfDocument,
}
# What damaged data leads to while it is read
DAMAGE = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    RecursionError,
    struct.error,
)
