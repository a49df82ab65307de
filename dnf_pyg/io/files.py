"""Mesh files in and out; only positions change, everything else of a file is kept."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from dnf_pyg.errors import MeshError, MeshFileError, OutputError
from dnf_pyg.io.atomic import write_files
from dnf_pyg.io.copies import Copies
from dnf_pyg.io.formats import DAMAGE, DOCUMENTS, Document
from dnf_pyg.io.formats.document import Floats, UnsupportedError

if TYPE_CHECKING:  # it takes a while to import
    import trimesh

__all__ = ["SUFFIXES", "MeshFile", "check_suffix", "find_meshes", "read_mesh", "write_mesh"]

SUFFIXES = tuple(DOCUMENTS)
_LARGEST = 1e30  # coordinate that validate_mesh takes
_NO_MESHES = (  # first bytes, in lower case, of what is found under the names of meshes
    (b"\x1f\x8b", "compressed with gzip", "Unpack it first."),
    (b"pk\x03\x04", "a zip archive", "Unpack it first."),
    (b"version https://git-lfs", "a pointer of Git LFS", "Run `git lfs pull` for the mesh itself."),
    (b"<!doctype html", "a web page", "Download the mesh itself."),
    (b"<html", "a web page", "Download the mesh itself."),
)
_ATTEMPTS = 10  # at names beside a mesh while other processes write to the same folder


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
    def mesh(self) -> "trimesh.Trimesh":
        """Positions and triangles as a trimesh, vertices and faces in the same order."""
        import trimesh

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
        dnf_pyg.errors.MeshFileError: Expected a mesh file (got 'absent.obj', which does not exist). Check the path.
    """
    path = Path(path)
    suffix = check_suffix(path)
    data = _read_bytes(path)
    if not data:
        raise MeshFileError(f"Expected a {suffix} mesh (got '{path}', which has 0 bytes). Export it again.")
    try:
        _check_kind(data)
        document = DOCUMENTS[suffix](data, path.parent)
    except DAMAGE as error:
        reason = str(error) or type(error).__name__
        remedy = error.remedy if isinstance(error, UnsupportedError) else "Export it again."
        raise MeshFileError(f"Expected a {suffix} mesh (got '{path}', unreadable: {reason}). {remedy}") from error
    face = document.face
    if len(face) == 0:
        raise MeshError(f"Expected a mesh with triangles (got '{path}' without any). Mesh a point cloud first.")
    if face.min() < 0 or face.max() >= len(document.pos):
        wrong = face[(face < 0) | (face >= len(document.pos))][0]
        reason = f"'{path}', where a face names vertex {wrong} of {len(document.pos)}"
        raise MeshFileError(f"Expected faces of existing vertices (got {reason}, counted from 0). Export it again.")
    document.settle_unused(_LARGEST)
    return MeshFile(path, document, torch.from_numpy(document.pos), torch.from_numpy(face).t().contiguous())


def write_mesh(mesh: "MeshFile | trimesh.Trimesh", pos: Tensor, path: str | Path) -> None:
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
        >>> import trimesh
        >>> write_mesh(trimesh.creation.box(), torch.zeros(8, 3), "box.docx")
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file ending in ... (got 'box.docx'). Convert it first.
    """
    path = Path(path)
    suffix = check_suffix(path)
    num_vertices = len(mesh.pos) if isinstance(mesh, MeshFile) else len(mesh.vertices)
    if len(pos) != num_vertices:
        raise ValueError(f"Expected 'pos' with {num_vertices} vertices (got {len(pos)}). Give one row per vertex.")
    new_pos = pos.detach().cpu().double().numpy()
    for _ in range(_ATTEMPTS):
        copies = Copies(path)
        if isinstance(mesh, MeshFile) and mesh.path.suffix.lower() == suffix:
            data = copies.carry(mesh.document.with_positions(new_pos), mesh.path)
        else:
            data = _converted(mesh, new_pos, copies)
        try:
            write_files({**copies.files, path: data}, new=copies.files.keys())
        except FileExistsError:
            continue  # another process has taken a name since it was chosen
        return
    raise OutputError(f"Expected '{path.parent}' not to change all the time. Write to another folder.")


def _converted(mesh: "MeshFile | trimesh.Trimesh", pos: Floats, copies: Copies) -> bytes:
    from dnf_pyg.io.convert import convert, export  # trimesh takes a while to import

    if isinstance(mesh, MeshFile):
        return convert(mesh.document, mesh.path, pos, copies)
    moved = mesh.copy()
    moved.vertices = pos
    return export(moved, copies)


def find_meshes(paths: Iterable[Path]) -> list[Path]:
    """List mesh files, folders replaced by the meshes in them, by name; hidden files are passed over.

    Args:
        paths: Files and folders.

    Raises:
        MeshFileError: If a path does not exist, a folder holds no mesh, or two files have the same name.

    Examples:
        >>> find_meshes([Path("absent")])
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file (got 'absent', which does not exist). Check the path.
    """
    found = []
    for path in paths:
        try:
            if not path.exists():
                raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist). Check the path.")
            if not path.is_dir():
                found.append(path)
                continue
            shown = [file for file in sorted(path.iterdir()) if not file.name.startswith(".")]
            inside = [file for file in shown if file.suffix.lower() in SUFFIXES and not file.is_dir()]
        except PermissionError as error:
            raise MeshFileError(
                f"Expected a readable folder (got '{path}': {error.strerror}). Check its permissions."
            ) from error
        if not inside:
            raise MeshFileError(f"Expected a folder with meshes (got '{path}' without any). Give one that has some.")
        found += inside
    twice = sorted(name for name, count in Counter(path.name for path in found).items() if count > 1)
    if twice:
        raise MeshFileError(f"Expected inputs of different names (got two of {twice}). Denoise them in separate calls.")
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
        raise MeshFileError(f"Expected a mesh file ending in {', '.join(SUFFIXES)} (got '{path}'). Convert it first.")
    return suffix


def _check_kind(data: bytes) -> None:
    start = data[:100].lstrip().lower()
    for beginning, what, remedy in _NO_MESHES:
        if start.startswith(beginning):
            raise UnsupportedError(f"it is {what}", remedy)


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist). Check the path.") from error
    except OSError as error:
        raise MeshFileError(
            f"Expected a readable file (got '{path}': {error.strerror}). Check its permissions."
        ) from error
