"""Meshes of trimesh, PyVista, Open3D and meshio: their triangles, and the same kind of mesh with other positions.

They are recognised by the module of their class, so that importing this imports none of these libraries.
"""

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.io.arrays import MeshInput, from_arrays, like

if TYPE_CHECKING:
    import trimesh

__all__ = ["FOREIGN"]


def _from_trimesh(mesh: Any) -> MeshInput:
    import trimesh

    if isinstance(mesh, trimesh.Scene):
        return _from_scene(mesh)
    if not isinstance(mesh, trimesh.Trimesh):
        raise MeshError(f"Expected a trimesh.Trimesh or trimesh.Scene (got {type(mesh).__name__}). Mesh it first.")

    def with_positions(pos: Tensor) -> trimesh.Trimesh:
        result = mesh.copy()
        result.vertices = pos.numpy()
        return result

    return from_arrays(mesh.vertices, mesh.faces, with_positions)


def _from_scene(scene: "trimesh.Scene") -> MeshInput:
    """Join the meshes of a scene, each where the first of its nodes places it."""
    import trimesh

    placing: dict[str, NDArray[np.float64]] = {}
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        placing.setdefault(str(name), matrix)
    parts = {name: part for name, part in scene.geometry.items() if isinstance(part, trimesh.Trimesh)}
    vertices = [np.empty((0, 3))]
    faces = [np.empty((0, 3), dtype=np.int64)]
    rows = {}  # of each part in the joined mesh
    for name, part in parts.items():
        first = sum(map(len, vertices))
        rows[name] = slice(first, first + len(part.vertices))
        vertices.append(trimesh.transform_points(part.vertices, placing.get(name, np.eye(4))))
        faces.append(part.faces + first)
    before = np.concatenate(vertices)

    def with_positions(pos: Tensor) -> trimesh.Scene:
        result = scene.copy()
        has_moved = (pos.numpy() != before).any(axis=1, keepdims=True)
        for name, part in parts.items():
            back = np.linalg.inv(placing.get(name, np.eye(4)))
            after = trimesh.transform_points(pos.numpy()[rows[name]], back)
            result.geometry[name].vertices = np.where(has_moved[rows[name]], after, part.vertices)
        return result

    return from_arrays(before, np.concatenate(faces), with_positions)


def _from_pyvista(mesh: Any) -> MeshInput:
    faces = np.asarray(getattr(mesh, "faces", ())).ravel()
    if len(faces) % 4 or (faces[::4] != 3).any() or not len(faces):
        raise MeshError("Expected a PyVista PolyData of triangles (got other cells). Call mesh.triangulate() first.")

    def with_positions(pos: Tensor) -> Any:
        result = mesh.copy()
        result.points = like(pos, np.asarray(mesh.points))
        return result

    return from_arrays(mesh.points, faces.reshape(-1, 4)[:, 1:], with_positions)


def _from_open3d(mesh: Any) -> MeshInput:
    if not hasattr(mesh, "triangles"):
        raise MeshError(f"Expected an open3d.geometry.TriangleMesh (got {type(mesh).__name__}). Call mesh.to_legacy().")

    def with_positions(pos: Tensor) -> Any:
        result = copy.deepcopy(mesh)
        result.vertices = type(mesh.vertices)(pos.numpy())
        if result.has_vertex_normals():
            result.compute_vertex_normals()
        return result

    return from_arrays(mesh.vertices, mesh.triangles, with_positions)


def _from_meshio(mesh: Any) -> MeshInput:
    kinds = {block.type for block in mesh.cells} - {"line", "vertex"}
    if kinds != {"triangle"}:
        raise MeshError(f"Expected a meshio.Mesh of triangles (got cells {sorted(kinds)}). Triangulate it first.")

    def with_positions(pos: Tensor) -> Any:
        result = copy.deepcopy(mesh)
        result.points = like(pos, np.asarray(mesh.points))
        return result

    faces = [block.data for block in mesh.cells if block.type == "triangle"]
    return from_arrays(mesh.points, np.concatenate(faces), with_positions)


FOREIGN: dict[str, Callable[[Any], MeshInput]] = {
    "trimesh": _from_trimesh,
    "pyvista": _from_pyvista,
    "open3d": _from_open3d,
    "meshio": _from_meshio,
}
