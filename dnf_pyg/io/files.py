"""Mesh files in and out; only positions change, everything else of a file is kept."""

import struct
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import torch
import trimesh
from torch import Tensor

from dnf_pyg.errors import MeshError, MeshFileError
from dnf_pyg.io.atomic import write_files
from dnf_pyg.io.convert import companions, convert, export
from dnf_pyg.io.formats import DOCUMENTS, Document

__all__ = ["SUFFIXES", "MeshFile", "check_suffix", "find_meshes", "read_mesh", "write_mesh"]

SUFFIXES = tuple(DOCUMENTS)
_DAMAGE = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    RecursionError,
    struct.error,
)


@dataclass(frozen=True)
class MeshFile:
    """A mesh as read from a file.

    Attributes:
        path: The file it came from.
        document: The file's content, which can be written again with other positions.
        pos: Vertex positions, (V, 3) float64, in the file's units and order.
        face: Vertices of each triangle, (3, F) long, in the file's order; polygons are split into fans.
    """

    path: Path
    document: Document
    pos: Tensor
    face: Tensor

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """Positions and triangles as a trimesh, vertices and faces in the same order."""
        return trimesh.Trimesh(self.pos.numpy(), self.face.t().numpy(), process=False)


def read_mesh(path: str | Path) -> MeshFile:
    """Read a triangle mesh.

    Args:
        path: An obj, ply (ascii or binary), stl, off, glb or gltf file.

    Returns:
        Positions and faces in the order of the file.

    Raises:
        MeshFileError: If the file is missing, empty, unreadable, damaged or of an unknown format.
        MeshError: If it holds no triangles.

    Examples:
        >>> read_mesh("absent.obj")
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file (got 'absent.obj', which does not exist): check the path
    """
    path = Path(path)
    suffix = check_suffix(path)
    data = _read_bytes(path)
    if not data:
        raise MeshFileError(f"Expected a {suffix} mesh (got '{path}', which has 0 bytes): export it again")
    try:
        document = DOCUMENTS[suffix](data, path.parent)
    except _DAMAGE as error:
        reason = str(error) or type(error).__name__
        raise MeshFileError(
            f"Expected a {suffix} mesh (got '{path}', unreadable: {reason}): export it again"
        ) from error
    face = document.face
    if len(face) == 0:
        raise MeshError(f"Expected a mesh with triangles (got '{path}' without any): mesh a point cloud first")
    if face.min() < 0 or face.max() >= len(document.pos):
        wrong = face[(face < 0) | (face >= len(document.pos))][0]
        reason = f"'{path}', where a face names vertex {wrong} of {len(document.pos)}"
        raise MeshFileError(f"Expected faces of existing vertices (got {reason}, counted from 0): export it again")
    return MeshFile(path, document, torch.from_numpy(document.pos), torch.from_numpy(face).t().contiguous())


def write_mesh(mesh: MeshFile | trimesh.Trimesh, pos: Tensor, path: str | Path) -> None:
    """Write a mesh with new vertex positions; the file appears whole or not at all.

    In the format of the file that the mesh was read from, everything else stays as it is, to the byte; normals that it
    stores are computed again. Materials and textures beside it are copied where they are missing. Another format keeps
    the triangles in their order and what both formats know; texture coordinates in an obj file split vertices there.

    Args:
        mesh: The mesh whose faces, colours, textures and so on are written.
        pos: New vertex positions, (V, 3).
        path: File to write; its ending decides the format.

    Raises:
        MeshFileError: If the format is unknown or the file cannot be written.
        ValueError: If the number of positions differs.

    Examples:
        >>> write_mesh(trimesh.creation.box(), torch.zeros(8, 3), "box.docx")
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file ending in ... (got 'box.docx'): convert it first
    """
    path = Path(path)
    suffix = check_suffix(path)
    num_vertices = len(mesh.pos) if isinstance(mesh, MeshFile) else len(mesh.vertices)
    if len(pos) != num_vertices:
        raise ValueError(f"Expected 'pos' with {num_vertices} vertices (got {len(pos)})")
    new_pos = pos.detach().cpu().double().numpy()
    if isinstance(mesh, trimesh.Trimesh):
        moved = mesh.copy()
        moved.vertices = new_pos
        files = export(moved, path)
    elif mesh.path.suffix.lower() == suffix:
        files = {**_companions(mesh, path), path: mesh.document.with_positions(new_pos)}
    else:
        files = {**_companions(mesh, path), **convert(mesh.document, mesh.path, new_pos, path)}
    write_files(files)


def find_meshes(paths: Iterable[Path]) -> list[Path]:
    """List mesh files, folders replaced by the meshes in them, by name; hidden files are passed over.

    Args:
        paths: Files and folders.

    Raises:
        MeshFileError: If a path does not exist, a folder holds no mesh, or two files have the same name.

    Examples:
        >>> find_meshes([Path("absent")])
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file (got 'absent', which does not exist): check the path
    """
    found = []
    for path in paths:
        try:
            if not path.exists():
                raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist): check the path")
            if not path.is_dir():
                found.append(path)
                continue
            shown = [file for file in sorted(path.iterdir()) if not file.name.startswith(".")]
            inside = [file for file in shown if file.suffix.lower() in SUFFIXES and not file.is_dir()]
        except PermissionError as error:
            raise MeshFileError(
                f"Expected a readable folder (got '{path}': {error.strerror}): check permissions"
            ) from error
        if not inside:
            raise MeshFileError(f"Expected a folder with meshes (got '{path}' without any): give one that has some")
        found += inside
    twice = sorted(name for name, count in Counter(path.name for path in found).items() if count > 1)
    if twice:
        raise MeshFileError(f"Expected inputs of different names (got two of {twice}): denoise them apart")
    return found


def check_suffix(path: Path) -> str:
    """Lower-case ending of a mesh file.

    Raises:
        MeshFileError: If it is of no known format.

    Examples:
        >>> check_suffix(Path("a.OBJ"))
        '.obj'
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise MeshFileError(f"Expected a mesh file ending in {', '.join(SUFFIXES)} (got '{path}'): convert it first")
    return suffix


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist): check the path") from error
    except OSError as error:
        raise MeshFileError(f"Expected a readable file (got '{path}': {error.strerror}): check permissions") from error


def _companions(mesh: MeshFile, path: Path) -> dict[Path, bytes]:
    """Materials and textures that lie beside or below the file and are missing in another folder."""
    names = companions(mesh.document, mesh.path.suffix.lower(), path.suffix.lower())
    inside = [name for name in dict.fromkeys(map(Path, names)) if not name.is_absolute() and ".." not in name.parts]
    missing = [name for name in inside if (mesh.path.parent / name).is_file() and not (path.parent / name).exists()]
    return {path.parent / name: _read_bytes(mesh.path.parent / name) for name in missing}
