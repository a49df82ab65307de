"""Meshes as arrays: vertices (V, 3) and faces (F, 3) of any type as tensors, and back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dnf_pyg.errors import MeshError

__all__ = ["MeshInput", "from_arrays", "like"]


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


def from_arrays(vertices: Any, faces: Any, with_positions: Callable[[Tensor], Any]) -> MeshInput:
    """Take arrays or tensors (V, 3) and (F, 3) of any type, device and strides.

    Args:
        vertices: Positions.
        faces: Vertices of each triangle.
        with_positions: See :class:`MeshInput`.

    Raises:
        MeshError: If the shapes are others, or the faces are no whole numbers.
    """
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


def like(pos: Tensor, original: Any) -> Any:
    """Positions as an array or tensor like the original one; whole numbers become float64."""
    if isinstance(original, Tensor):
        return pos.to(original.device, original.dtype if original.is_floating_point() else pos.dtype)
    dtype = np.asarray(original).dtype
    return pos.numpy().astype(dtype if np.issubdtype(dtype, np.floating) else np.float64)
