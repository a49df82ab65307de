"""Faces that a movement of the vertices flips, and how that is undone."""

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import face_normals

__all__ = ["flipped_faces", "without_flips"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FLAT = 1e-5  # area relative to the squares of the sides up to which a face is a line


def flipped_faces(pos: Tensor, face: Tensor, normal: Tensor) -> Tensor:
    """Mark the faces that are flipped against given normals.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        normal: Facet normals that they should have, (F, 3).

    Returns:
        Mask, (F,) bool, of the faces at more than 90 degrees to their normal.

    Examples:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> flipped_faces(pos, torch.tensor([[0], [1], [2]]), torch.tensor([[0.0, 0.6, -0.8]]))
        tensor([True])
    """
    return (face_normals(pos, face) * normal.to(pos)).sum(dim=-1) < 0


def without_flips(pos: Tensor, before: Tensor, face: Tensor, normal: Tensor) -> Tensor:
    """Revert the movement of vertices where it has flipped a face.

    Args:
        pos: Vertex positions after the movement, (V, 3).
        before: Vertex positions before the movement, (V, 3).
        face: Vertices of each face, (3, F).
        normal: Target facet normals, (F, 3).

    Returns:
        Positions, (V, 3), each from ``pos`` or ``before``, in which only faces that were flipped before are flipped
        against their target normal.

    Examples:
        >>> before = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> folded = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.1, 0.1, 0]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> without_flips(folded, before, face, torch.tensor([[0.0, 0, 1], [0, 0, 1]]))[3].tolist()
        [1.0, 1.0, 0.0]
    """
    center = before.mean(dim=0)
    start, moved = ((where - center).detach().cpu().double().numpy() for where in (before, pos))
    upright = moved.copy()
    corner = np.ascontiguousarray(face.cpu().t().numpy())
    revert_flips(upright, start, corner, np.ascontiguousarray(normal.detach().cpu().double().numpy()))
    stays = torch.from_numpy((upright == moved).all(axis=1)).to(pos.device)
    return torch.where(stays[:, None], pos, before)


@njit(cache=True, nogil=True)
def revert_flips(updated: Floats, before: Floats, face: Ints, normal: Floats) -> None:
    """Revert the vertices of the faces that an iteration has flipped, until there are no such faces."""
    upright = np.empty(len(face), dtype=np.bool_)  # a line has no side to lose
    for f in range(len(face)):
        upright[f] = _along(before, face[f], normal[f]) > 0 and not _is_line(before, face[f])
    reverted = True
    while reverted:  # each round reverts at least one more vertex
        reverted = False
        for f in range(len(face)):
            if upright[f] and _along(updated, face[f], normal[f]) <= 0:
                for v in face[f]:
                    for axis in range(3):
                        updated[v, axis] = before[v, axis]
                reverted = True


@njit(cache=True, nogil=True)
def _is_line(pos: Floats, face: Ints) -> bool:
    """Whether the corners of a face lie on a line, up to the digits of float32."""
    u, w = pos[face[1]] - pos[face[0]], pos[face[2]] - pos[face[0]]
    return np.square(np.cross(u, w)).sum() <= (_FLAT * (np.square(u).sum() + np.square(w).sum())) ** 2


@njit(cache=True, nogil=True)
def _along(pos: Floats, face: Ints, normal: Floats) -> float:
    """Compute twice the area of a face projected along a normal; negative if it is seen from behind."""
    a, b, c = pos[face[0]], pos[face[1]], pos[face[2]]
    u_x, u_y, u_z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    w_x, w_y, w_z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (
        normal[0] * (u_y * w_z - u_z * w_y) + normal[1] * (u_z * w_x - u_x * w_z) + normal[2] * (u_x * w_y - u_y * w_x)
    )
