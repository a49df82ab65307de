"""Mesh file formats: each reads positions and triangles and writes the file back with other positions.

All else in a file stays as it is: order, polygons, texture coordinates, materials, colours, attributes, comments.
"""

from dnf_pyg.mesh.formats.document import Document
from dnf_pyg.mesh.formats.glb import GlbDocument
from dnf_pyg.mesh.formats.gltf import GltfDocument
from dnf_pyg.mesh.formats.obj import ObjDocument
from dnf_pyg.mesh.formats.off import OffDocument
from dnf_pyg.mesh.formats.ply import PlyDocument
from dnf_pyg.mesh.formats.stl import StlDocument

__all__ = [
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
