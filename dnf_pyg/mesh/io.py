"""Mesh files in and out; vertices and faces keep their number and order."""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from torch import Tensor

from dnf_pyg.errors import MeshError, MeshFileError

__all__ = ["SUFFIXES", "MeshFile", "read_mesh", "write_mesh"]

SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")


@dataclass(frozen=True)
class MeshFile:
    """A mesh as read from a file.

    Attributes:
        path: The file it came from.
        pos: Vertex positions, (V, 3) float64, in the file's units and order.
        face: Vertices of each triangle, (3, F) long, in the file's order; quads are split.
        mesh: The mesh as trimesh read it.
    """

    path: Path
    pos: Tensor
    face: Tensor
    mesh: trimesh.Trimesh


def check_suffix(path: Path) -> str:
    """Return the lower-case file ending, or raise where no reader or writer knows it."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise MeshFileError(f"Expected a mesh file ending in {', '.join(SUFFIXES)} (got '{path}'): convert it first")
    return suffix


def read_mesh(path: str | Path) -> MeshFile:
    """Read a triangle mesh.

    Args:
        path: An obj, ply (ascii or binary), stl, off, glb or gltf file.

    Returns:
        Positions and faces in the order of the file.

    Raises:
        MeshFileError: If the file is missing, empty, unreadable or of an unknown format.
        MeshError: If it holds no triangles.

    Examples:
        >>> read_mesh("absent.obj")
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mesh file (got 'absent.obj', which does not exist): check the path
    """
    path = Path(path)
    suffix = check_suffix(path)
    if not path.is_file():
        raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist): check the path")
    try:
        if path.stat().st_size == 0:
            raise MeshFileError(f"Expected a {suffix} mesh (got '{path}', which has 0 bytes): export it again")
        mesh = trimesh.load(path, force="mesh", process=False, maintain_order=True)
    except MeshFileError:
        raise
    except OSError as error:
        raise MeshFileError(f"Expected a readable file (got '{path}': {error.strerror}): check permissions") from error
    except Exception as error:  # trimesh parsers raise whatever the damaged bytes lead to
        raise MeshFileError(f"Expected a {suffix} mesh (got '{path}', unreadable: {error}): export it again") from error
    face = np.asarray(getattr(mesh, "faces", np.empty((0, 3))))
    if len(face) == 0:
        raise MeshError(f"Expected a mesh with triangles (got '{path}' without any): mesh a point cloud first")
    pos = torch.tensor(np.asarray(mesh.vertices), dtype=torch.float64)
    return MeshFile(path, pos, torch.tensor(face, dtype=torch.long).t().contiguous(), mesh)


def write_mesh(mesh: MeshFile | trimesh.Trimesh, pos: Tensor, path: str | Path) -> None:
    """Write a mesh with new vertex positions; the file appears whole or not at all.

    Args:
        mesh: The mesh whose faces, colours and textures are written.
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
    source = mesh.mesh if isinstance(mesh, MeshFile) else mesh
    if len(pos) != len(source.vertices):
        raise ValueError(f"Expected 'pos' with {len(source.vertices)} vertices (got {len(pos)})")
    moved = source.copy()
    moved.vertices = pos.detach().cpu().double().numpy()
    data: Any = moved.export(file_type=suffix[1:])
    write_atomically(path, data.encode() if isinstance(data, str) else data)


def write_atomically(path: Path, data: bytes) -> None:
    """Write bytes beside ``path`` and move them there in one step."""
    try:
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise MeshFileError(
            f"Expected a writable folder for '{path}' (got: {error.strerror}): create it or choose another"
        ) from error
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o666 & ~current_umask())
        os.replace(temporary, path)
    except OSError as error:
        raise MeshFileError(
            f"Expected to write '{path}' (got: {error.strerror}): free some space or choose another place"
        ) from error
    finally:
        Path(temporary).unlink(missing_ok=True)


def current_umask() -> int:
    """Permissions that new files of this process lack (mkstemp makes private ones)."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
