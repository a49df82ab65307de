"""Meshes of other libraries: their triangles as tensors, and the same kind of mesh with other vertex positions.

Meshes of PyVista, Open3D and meshio are recognised by the module of their class, so that none of them is imported.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.errors import MeshError, OptionError
from dnf_pyg.io.atomic import write_files
from dnf_pyg.io.convert import export
from dnf_pyg.io.copies import Copies
from dnf_pyg.io.files import MeshFile, check_suffix, read_mesh, write_mesh

__all__ = ["MeshInput", "as_input", "as_mask", "save_mesh"]


@dataclass(frozen=True)
class MeshInput:
    """The triangles of a mesh of any kind, and the way back to that kind.

    Attributes:
        pos: Vertex positions, (V, 3) float64.
        face: Vertices of each triangle, (3, F) long.
        with_positions: Makes a copy of the mesh with other vertex positions, (V, 3) float64; all else stays.
    """

    pos: Tensor
    face: Tensor
    with_positions: Callable[[Tensor], Any]


def as_input(mesh: Any) -> MeshInput:
    """Read the triangles of a mesh.

    Args:
        mesh: Path of a mesh file; :class:`~dnf_pyg.io.files.MeshFile`; arrays ``(vertices, faces)``, (V, 3) and (F, 3);
            PyG ``Data`` with ``pos`` (V, 3) and ``face`` (3, F); ``trimesh.Trimesh``; ``trimesh.Scene``, whose meshes
            are taken together where their first node places them; triangle mesh of PyVista (``PolyData``), Open3D
            (``open3d.geometry.TriangleMesh``) or meshio.

    Raises:
        MeshError: If it is none of these, or has faces other than triangles.
        MeshFileError: If a file cannot be read.

    Example:
        >>> as_input(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).face.shape
        torch.Size([3, 1])
    """
    if isinstance(mesh, str | Path):
        mesh = read_mesh(mesh)
    if isinstance(mesh, MeshFile):
        return MeshInput(mesh.pos, mesh.face, lambda pos: replace(mesh, pos=pos))
    if isinstance(mesh, trimesh.Trimesh):
        return _from_arrays(mesh.vertices, mesh.faces, lambda pos: _moved_trimesh(mesh, pos))
    if isinstance(mesh, trimesh.Scene):
        return _from_scene(mesh)
    if isinstance(mesh, Data):
        return _from_data(mesh)
    if isinstance(mesh, tuple | list) and len(mesh) == 2:
        return _from_pair(mesh)
    reader = _FOREIGN.get(type(mesh).__module__.partition(".")[0])
    if reader is None:
        raise MeshError(
            "Expected 'mesh' to be a path, (vertices, faces), a PyG Data with pos and face, or a mesh of trimesh, "
            f"PyVista, Open3D or meshio (got {type(mesh).__name__}). Convert it to one of these."
        )
    return reader(mesh)


def as_mask(mask: Tensor | NDArray[np.bool_] | None, num_vertices: int) -> Tensor:
    """Read a mask of vertices, (V,) bool; all vertices if there is none.

    Raises:
        OptionError: If it has another shape or type.

    Example:
        >>> as_mask(None, 2)
        tensor([True, True])
    """
    if mask is None:
        return torch.ones(num_vertices, dtype=torch.bool)
    mask = mask.cpu() if isinstance(mask, Tensor) else torch.from_numpy(np.array(mask))
    if mask.shape != (num_vertices,) or mask.dtype != torch.bool:
        raise OptionError(
            f"Expected 'mask' of shape [{num_vertices}] and type bool (got {list(mask.shape)} {mask.dtype}). Give one "
            "entry for each vertex."
        )
    return mask


def save_mesh(mesh: Any, pos: Tensor, face: Tensor, path: str | Path) -> None:
    """Write a mesh of any kind; the file appears whole or not at all.

    A mesh from a file, a mesh of trimesh, and a scene of trimesh as glb or gltf keep their colours, textures and so on,
    as far as the format can hold them; of any other kind the triangles are written.

    Args:
        mesh: The mesh.
        pos: Its vertex positions, (V, 3).
        face: Its triangles, (3, F).
        path: File to write; its ending decides the format.

    Raises:
        MeshFileError: If the format is unknown.
        OutputError: If the file cannot be written.
    """
    path = Path(path)
    check_suffix(path)
    if isinstance(mesh, trimesh.Scene) and path.suffix.lower() in (".glb", ".gltf"):
        scene: Any = mesh  # trimesh exports scenes and meshes alike
        copies = Copies(path)
        data = export(scene, copies)
        write_files({**copies.files, path: data})
    elif isinstance(mesh, MeshFile | trimesh.Trimesh):
        write_mesh(mesh, pos, path)
    else:
        write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)


def _from_arrays(vertices: Any, faces: Any, with_positions: Callable[[Tensor], Any]) -> MeshInput:
    """Take arrays or tensors (V, 3) and (F, 3) of any type, device and strides."""
    pos, face = (np.asarray(part.detach().cpu() if isinstance(part, Tensor) else part) for part in (vertices, faces))
    for name, part, remedy in (
        ("vertices", pos, "Give x, y, z of each"),
        ("faces", face, "Triangulate or transpose it"),
    ):
        if part.ndim != 2 or part.shape[1] != 3:
            raise MeshError(f"Expected '{name}' of shape [number, 3] (got {list(part.shape)}). {remedy}.")
    if not np.issubdtype(face.dtype, np.integer) and face.size:
        raise MeshError(f"Expected 'faces' to be whole numbers (got {face.dtype}). Give the vertices of each face.")
    tensors = torch.from_numpy(pos.astype(np.float64)), torch.from_numpy(face.astype(np.int64, order="C"))
    return MeshInput(tensors[0], tensors[1].t().contiguous(), with_positions)


def _from_pair(mesh: tuple[Any, Any] | list[Any]) -> MeshInput:
    vertices, faces = mesh
    rebuild = list if isinstance(mesh, list) else tuple
    return _from_arrays(vertices, faces, lambda pos: rebuild((_like(pos, vertices), faces)))


def _from_data(mesh: Data) -> MeshInput:
    if mesh.pos is None or mesh.face is None:
        raise MeshError("Expected a PyG Data with 'pos' and 'face' (got one without). Add pos (V, 3) and face (3, F).")
    pos, face = mesh.pos, mesh.face

    def with_positions(moved: Tensor) -> Data:
        result = mesh.clone()
        result.pos = _like(moved, pos)
        return result

    return _from_arrays(pos, face.t(), with_positions)


def _from_scene(scene: trimesh.Scene) -> MeshInput:
    """Join the meshes of a scene, each where the first of its nodes places it."""
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

    return _from_arrays(before, np.concatenate(faces), with_positions)


def _from_pyvista(mesh: Any) -> MeshInput:
    faces = np.asarray(getattr(mesh, "faces", ())).ravel()
    if len(faces) % 4 or (faces[::4] != 3).any() or not len(faces):
        raise MeshError("Expected a PyVista PolyData of triangles (got other cells). Call mesh.triangulate() first.")

    def with_positions(pos: Tensor) -> Any:
        result = mesh.copy()
        result.points = _like(pos, np.asarray(mesh.points))
        return result

    return _from_arrays(mesh.points, faces.reshape(-1, 4)[:, 1:], with_positions)


def _from_open3d(mesh: Any) -> MeshInput:
    if not hasattr(mesh, "triangles"):
        raise MeshError(f"Expected an open3d.geometry.TriangleMesh (got {type(mesh).__name__}). Call mesh.to_legacy().")

    def with_positions(pos: Tensor) -> Any:
        result = copy.deepcopy(mesh)
        result.vertices = type(mesh.vertices)(pos.numpy())
        if result.has_vertex_normals():
            result.compute_vertex_normals()
        return result

    return _from_arrays(mesh.vertices, mesh.triangles, with_positions)


def _from_meshio(mesh: Any) -> MeshInput:
    kinds = {block.type for block in mesh.cells} - {"line", "vertex"}
    if kinds != {"triangle"}:
        raise MeshError(f"Expected a meshio.Mesh of triangles (got cells {sorted(kinds)}). Triangulate it first.")

    def with_positions(pos: Tensor) -> Any:
        result = copy.deepcopy(mesh)
        result.points = _like(pos, np.asarray(mesh.points))
        return result

    faces = [block.data for block in mesh.cells if block.type == "triangle"]
    return _from_arrays(mesh.points, np.concatenate(faces), with_positions)


_FOREIGN: dict[str, Callable[[Any], MeshInput]] = {
    "pyvista": _from_pyvista,
    "open3d": _from_open3d,
    "meshio": _from_meshio,
}


def _moved_trimesh(mesh: trimesh.Trimesh, pos: Tensor) -> trimesh.Trimesh:
    result = mesh.copy()
    result.vertices = pos.numpy()
    return result


def _like(pos: Tensor, original: Any) -> Any:
    """Positions as an array or tensor like the original one; whole numbers become float64."""
    if isinstance(original, Tensor):
        return pos.to(original.device, original.dtype if original.is_floating_point() else pos.dtype)
    dtype = np.asarray(original).dtype
    return pos.numpy().astype(dtype if np.issubdtype(dtype, np.floating) else np.float64)
