"""Meshes from one file format to another: triangles in the same order, and what both formats know."""

import io
import logging
import re
import warnings
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dnf_pyg.errors import MeshFileWarning, OutputError
from dnf_pyg.io.copies import Copies, warn_left_out
from dnf_pyg.io.folder import CompanionError, find_beside
from dnf_pyg.io.formats import Document, GlbDocument, GltfDocument, OffDocument, StlDocument
from dnf_pyg.io.formats.document import Floats, Ints
from dnf_pyg.io.formats.glb import glb_bytes
from dnf_pyg.io.formats.gltf import gltf_text
from dnf_pyg.io.formats.mtl import place_pictures

__all__ = ["convert", "export"]

_MOST_SHOWN = 10_000_000  # triangles of all copies of the meshes in a scene


def convert(document: Document, source: Path, pos: Floats, copies: Copies) -> bytes:
    """Write a document in another format.

    Args:
        document: What was read.
        source: File that it was read from.
        pos: New vertex positions, (V, 3).
        copies: Where materials and textures beside the target go; the ending of its target decides the format.

    Returns:
        Content of the target.
    """
    suffix = copies.target.suffix.lower()
    if isinstance(document, GltfDocument) and suffix in (".glb", ".gltf"):
        tree, buffers = document.scene.moved(pos, document.moved(pos))
        data = glb_bytes(tree, buffers) if suffix == ".glb" else gltf_text(tree, dict(enumerate(buffers)))
        return copies.carry(data, source)
    has_uv = suffix not in (".off", ".stl")
    is_scene = isinstance(document, GltfDocument)
    return export(_in_order(_as_trimesh(document, source, pos), pos, document.face, has_uv, is_scene), copies)


def export(mesh: trimesh.Trimesh, copies: Copies) -> bytes:
    """Content of a file that holds a mesh in the format of the ending of the target of ``copies``."""
    suffix = copies.target.suffix.lower()
    if suffix == ".obj":
        return _export_obj(mesh, copies)
    if suffix == ".gltf":
        return GlbDocument(trimesh.exchange.gltf.export_glb(mesh), copies.target.parent).as_gltf()
    if suffix == ".ply":
        mesh = mesh.copy()
        for attributes in (mesh.vertex_attributes, mesh.face_attributes):
            for name in [name for name in attributes if not re.fullmatch(r"\w+", name, re.ASCII)]:
                attributes[re.sub(r"\W+", "_", name, flags=re.ASCII) or "_"] = attributes.pop(name)
    data: Any = mesh.export(file_type=suffix[1:])
    return data.encode() if isinstance(data, str) else data


def _export_obj(mesh: trimesh.Trimesh, copies: Copies) -> bytes:
    """Text of an obj file; its material and texture get names of our own, whatever the mesh calls them."""
    mesh = mesh.copy()
    mesh.metadata.pop("name", None)
    material = getattr(mesh.visual, "material", None)
    stem = re.sub(r"[^\w-]", "_", copies.target.stem)
    if material is not None:
        material.name = f"{stem}_material"
    library = f"{stem}.mtl"
    text, beside = trimesh.exchange.obj.export_obj(mesh, return_texture=True, mtl_name=library)
    if library not in beside:
        return text.encode()
    try:
        given = {name: copies.add(name, data) for name, data in beside.items() if name != library}
        materials = place_pictures(beside[library], copies.target.parent, PurePosixPath(), lambda name: given[name])
        return text.replace(f"mtllib {library}\n", f"mtllib {copies.add(library, materials)}\n", 1).encode()
    except CompanionError as error:
        raise OutputError(
            f"Expected a free name for the material beside '{copies.target}' (got the reason: {error}). "
            "Write to another folder."
        ) from error


def _as_trimesh(document: Document, source: Path, pos: Floats) -> trimesh.Trimesh:
    """Let trimesh read the document with other positions, so that it takes along what it can.

    Warns:
        MeshFileWarning: If trimesh cannot read it; positions and triangles are all there is then.
    """
    plain = trimesh.Trimesh(pos, document.face, process=False)
    if isinstance(document, OffDocument | StlDocument):  # trimesh knows fewer kinds, and there is nothing to take along
        return plain
    data = io.BytesIO(document.with_positions(pos))
    options: dict[str, Any] = {"process": False, "maintain_order": True}
    beside = _Beside(source.parent)
    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)  # pictures that it cannot read
    try:
        if isinstance(document, GltfDocument) and document.scene.num_shown > _MOST_SHOWN:
            raise ValueError(f"its nodes show its meshes so often that they have {document.scene.num_shown:,} faces")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # materials without textures, pictures that are large
            loaded = trimesh.load_mesh(data, file_type=source.suffix.lower()[1:], resolver=beside, **options)
        if not isinstance(loaded, trimesh.Trimesh):
            raise ValueError("it holds no mesh for trimesh")
    except Exception as error:  # whatever trimesh, or a library below it, raises for data that it cannot read
        reason = str(error) or type(error).__name__
        warnings.warn(
            f"Expected a mesh whose colours and textures can be converted (got '{source}': {reason}). Only "
            f"positions and faces are written: write it as {source.suffix} to keep the rest.",
            MeshFileWarning,
            stacklevel=4,
        )
        return plain
    finally:
        log.setLevel(level)
    warn_left_out(source, beside.left_out)
    return loaded


class _Beside(trimesh.resolvers.Resolver):
    """Let trimesh read files in or below a folder, and no others."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.left_out: dict[str, str] = {}  # reason by name

    def get(self, key: str) -> bytes:
        name = key.strip()
        try:
            return find_beside(self.folder, name).read_bytes()
        except (CompanionError, OSError) as error:
            self.left_out[name] = str(error)
            raise

    def write(self, name: str, data: bytes) -> None:
        raise NotImplementedError

    def namespaced(self, namespace: str) -> "_Beside":
        return self

    def keys(self) -> list[str]:
        return []


def _in_order(loaded: trimesh.Trimesh, pos: Floats, face: Ints, has_uv: bool, is_scene: bool) -> trimesh.Trimesh:
    """Put back the order of triangles, and of vertices unless texture coordinates that are kept split them.

    trimesh sorts triangles by material and by polygon. A scene that shows a mesh several times keeps all copies.
    """
    if len(loaded.faces) != len(face):
        return loaded if is_scene else trimesh.Trimesh(pos, face, process=False)  # strips of a ply file
    corner = pos[face]
    order = _matching(loaded.triangles, corner)
    if order is None:
        return loaded
    loaded.update_faces(order)
    turns = [np.roll(loaded.faces, -turn, axis=1) for turn in range(3)]
    apart = [np.abs(loaded.vertices[turned] - corner).sum(axis=(1, 2)) for turned in turns]
    loaded.faces = np.choose(np.argmin(apart, axis=0)[:, None], turns)
    visual: Any = loaded.visual
    if visual.kind == "texture" and visual.uv is not None and has_uv:
        return loaded
    if len(loaded.vertices) == len(pos) and np.array_equal(loaded.faces, face):
        return loaded
    exact: Any = trimesh.Trimesh(pos, face, process=False)
    if visual.kind == "vertex":
        color = np.full((len(pos), 4), 255, dtype=np.uint8)
        color[face] = visual.vertex_colors[loaded.faces]
        exact.visual.vertex_colors = color
    elif visual.kind == "face":
        exact.visual.face_colors = visual.face_colors
    elif visual.kind == "texture":
        exact.visual = trimesh.visual.TextureVisuals(material=visual.material)
    return exact


def _matching(triangles: Floats, wanted: Floats) -> NDArray[np.int64] | None:
    """Which of the triangles (F, 3, 3) is which of the wanted ones, whatever their first corner; None if unclear."""
    if np.allclose(triangles, wanted, rtol=0, atol=1e-6 * np.ptp(wanted, axis=(0, 1)).max(initial=0.0)):
        return np.arange(len(wanted))
    keys = [_key(corner) for corner in (triangles, wanted)]
    order = np.asarray(cKDTree(keys[0]).query(keys[1])[1], dtype=np.int64)
    return order if len(np.unique(order)) == len(order) else None


def _key(corner: Floats) -> Floats:
    """Centroid and side that triangles (F, 3, 3) look to, (F, 6): the same for every first corner."""
    a, b, c = corner.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.sqrt(np.linalg.norm(normal, axis=1, keepdims=True))
    return np.hstack([corner.mean(axis=1), normal / np.where(size > 0, size, 1.0)])
