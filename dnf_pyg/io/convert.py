"""Meshes from one file format to another: triangles in the same order, and what both formats know."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dnf_pyg.io.formats import Document, GlbDocument, GltfDocument
from dnf_pyg.io.formats.document import Floats, Ints
from dnf_pyg.io.formats.glb import glb_bytes
from dnf_pyg.io.formats.gltf import gltf_text, uris_beside

__all__ = ["companions", "convert", "export"]


def convert(document: Document, source: Path, pos: Floats, target: Path) -> dict[Path, bytes]:
    """Write a document in another format.

    Args:
        document: What was read.
        source: File that it was read from.
        pos: New vertex positions, (V, 3).
        target: File to write, whose ending decides the format.

    Returns:
        Content of the files to write, by path; the mesh itself comes last.
    """
    suffix = target.suffix.lower()
    if isinstance(document, GlbDocument | GltfDocument) and suffix in (".glb", ".gltf"):
        tree, buffers = document.scene.moved(pos, document.moved(pos))
        return {target: glb_bytes(tree, buffers) if suffix == ".glb" else gltf_text(tree, dict(enumerate(buffers)))}
    has_uv = suffix not in (".off", ".stl")
    return export(_in_order(_as_trimesh(document, source, pos), pos, document.face, has_uv), target)


def companions(document: Document, suffix: str, target_suffix: str) -> list[str]:
    """Names of the files beside a document that its conversion refers to as well."""
    if suffix == target_suffix:
        return document.companions()
    if isinstance(document, GlbDocument | GltfDocument) and target_suffix in (".glb", ".gltf"):
        return uris_beside(document.scene.tree, "images")
    return []


def export(mesh: trimesh.Trimesh, target: Path) -> dict[Path, bytes]:
    """Files, by path, that hold a mesh in the format of the target's ending; the mesh itself comes last."""
    suffix = target.suffix.lower()
    if suffix == ".obj":
        text, textures = trimesh.exchange.obj.export_obj(mesh, return_texture=True, mtl_name=f"{target.stem}.mtl")
        return {**{target.parent / name: data for name, data in textures.items()}, target: text.encode()}
    if suffix == ".gltf":
        return {target: GlbDocument(trimesh.exchange.gltf.export_glb(mesh), target.parent).as_gltf()}
    data: Any = mesh.export(file_type=suffix[1:])
    return {target: data.encode() if isinstance(data, str) else data}


def _as_trimesh(document: Document, source: Path, pos: Floats) -> trimesh.Trimesh:
    """Let trimesh read the document with other positions, so that it takes along what it can."""
    data = io.BytesIO(document.with_positions(pos))
    options: dict[str, Any] = {"process": False, "maintain_order": True}
    resolver = trimesh.resolvers.FilePathResolver(str(source))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of materials without textures, where there are several
        return trimesh.load_mesh(data, file_type=source.suffix.lower()[1:], resolver=resolver, **options)


def _in_order(loaded: trimesh.Trimesh, pos: Floats, face: Ints, has_uv: bool) -> trimesh.Trimesh:
    """Put back the order of triangles, and of vertices unless texture coordinates that are kept split them.

    trimesh sorts triangles by material and by polygon. A scene that shows a mesh several times keeps all copies.
    """
    if len(loaded.faces) != len(face):
        return loaded
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
