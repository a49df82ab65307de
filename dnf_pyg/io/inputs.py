"""Meshes of any kind: their triangles as tensors, and the same kind of mesh with other vertex positions."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.errors import MeshError, OptionError
from dnf_pyg.io.arrays import MeshInput, from_arrays, like
from dnf_pyg.io.atomic import write_files
from dnf_pyg.io.copies import Copies
from dnf_pyg.io.files import MeshFile, check_suffix, read_mesh, write_mesh
from dnf_pyg.io.foreign import FOREIGN

__all__ = ["MeshInput", "as_input", "as_mask", "save_mesh"]


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
    if isinstance(mesh, Data):
        return _from_data(mesh)
    if isinstance(mesh, tuple | list) and len(mesh) == 2:
        return _from_pair(mesh)
    packages = (kind.__module__.partition(".")[0] for kind in type(mesh).__mro__)
    reader = next((FOREIGN[name] for name in packages if name in FOREIGN), None)
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
    if isinstance(mesh, MeshFile):
        write_mesh(mesh, pos, path)
        return
    import trimesh

    from dnf_pyg.io.convert import export

    if isinstance(mesh, trimesh.Scene) and path.suffix.lower() in (".glb", ".gltf"):
        scene: Any = mesh  # trimesh exports scenes and meshes alike
        copies = Copies(path)
        data = export(scene, copies)
        write_files({**copies.files, path: data})
    elif isinstance(mesh, trimesh.Trimesh):
        write_mesh(mesh, pos, path)
    else:
        write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)


def _from_pair(mesh: tuple[Any, Any] | list[Any]) -> MeshInput:
    vertices, faces = mesh
    rebuild = list if isinstance(mesh, list) else tuple
    return from_arrays(vertices, faces, lambda pos: rebuild((like(pos, vertices), faces)))


def _from_data(mesh: Data) -> MeshInput:
    if mesh.pos is None or mesh.face is None:
        raise MeshError("Expected a PyG Data with 'pos' and 'face' (got one without). Add pos (V, 3) and face (3, F).")
    pos, face = mesh.pos, mesh.face

    def with_positions(moved: Tensor) -> Data:
        result = mesh.clone()
        result.pos = like(moved, pos)
        return result

    return from_arrays(pos, face.t(), with_positions)
