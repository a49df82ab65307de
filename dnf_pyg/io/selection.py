"""Selections of vertices or faces, read from a file or an attribute of the mesh."""

from pathlib import Path

import numpy as np
import torch
from numpy.lib.format import open_memmap
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import MeshFileError
from dnf_pyg.io.files import MeshFile

__all__ = ["read_selection"]

_WORDS = {"true": "1", "false": "0"}


def read_selection(source: str | Path, mesh: MeshFile) -> Tensor:
    r"""Read which vertices are selected.

    Args:
        source: A text file (numbers, ``true`` or ``false``, apart by blanks, commas or lines) or ``.npy`` file with one
            number per vertex or per triangle, selected where it is not 0; or the name of a vertex or face property of a
            ply mesh, or of a vertex attribute of a glb or gltf mesh (without the ``_`` before it). If there are as many
            triangles as vertices, the numbers are those of vertices.
        mesh: The mesh.

    Returns:
        Selected vertices, (V,) bool; those of selected faces.

    Raises:
        MeshFileError: If there is no such file or property, it holds something else, or another number of values.

    Examples:
        >>> from dnf_pyg.io.formats import ObjDocument
        >>> document = ObjDocument(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Path())
        >>> mesh = MeshFile(Path("a.obj"), document, torch.from_numpy(document.pos), torch.tensor([[0], [1], [2]]))
        >>> read_selection("absent.txt", mesh)
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a mask (got 'absent.txt', which is no file and no property ...
    """
    values = _values(source, mesh)
    if np.isnan(values).any():
        raise MeshFileError(f"Expected a mask of numbers (got NaN in '{source}'). Write 0 where the mesh has to stay.")
    selected = values != 0
    num_vertices, num_faces = len(mesh.pos), mesh.face.size(1)
    if len(selected) == num_vertices:
        return torch.from_numpy(selected)
    if len(selected) != num_faces:
        raise MeshFileError(
            f"Expected a mask with one number per vertex ({num_vertices}) or triangle ({num_faces}) "
            f"(got {len(selected)} in '{source}'). Make it for this mesh."
        )
    chosen = torch.zeros(num_vertices, dtype=torch.bool)
    chosen[mesh.face[:, torch.from_numpy(selected)]] = True
    return chosen


def _values(source: str | Path, mesh: MeshFile) -> NDArray[np.float64]:
    path = Path(source)
    try:
        if path.is_file():
            if path.suffix.lower() == ".npy":
                return open_memmap(path, mode="r").astype(np.float64).ravel()  # refuses what the file is too short for
            words = path.read_text(encoding="utf-8").replace(",", " ").lower().split()
            return np.array([_WORDS.get(word, word) for word in words], dtype=np.float64)
        return mesh.document.property(str(source))
    except KeyError:
        pass
    except (OSError, ValueError, TypeError, OverflowError) as error:
        raise MeshFileError(
            f"Expected a mask of numbers (got '{source}': {error}). Write one number per line."
        ) from error
    raise MeshFileError(
        f"Expected a mask (got '{source}', which is no file and no property of the mesh). Give one number per vertex "
        "or triangle in a .txt or .npy file, or the name of a property of a ply, glb or gltf mesh."
    )
