"""Faces that are flipped against the normals that they should have."""

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import face_normals

__all__ = ["flipped_faces", "revert_flips", "unfold", "without_flips"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

_MOST_ROUNDS = 20  # nearly all folds open in three
_STEEP = 0.1  # cosine of 84 degrees: the update would flip a face that is steeper, so its vertices would stay in place
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


def unfold(pos: Floats, face: Ints, normal: Floats, fixed: Flags, origin: Floats, max_move: Floats) -> Floats:
    """Open the folds that noise along the surface has made.

    The vertices of faces that are flipped, or nearly so, move along the surface to the mean of their neighbours. The
    vertex update cannot do this, because it moves vertices across the surface only.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (F, 3).
        normal: Target facet normals, (F, 3).
        fixed: Vertices that stay in place, (V,).
        origin: Positions that displacements are measured from, (V, 3).
        max_move: Largest displacement of each vertex, (V,), model units.

    Returns:
        Positions, (V, 3), in which only faces that were flipped before are flipped against their target normal. The
        vertices of folds that do not open within the limit stay in place.

    Examples:
        >>> pos = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [2, 2, 0]])  # the last one should lie between the others
        >>> face, up = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]]), np.array([[0.0, 0, 1]] * 3)
        >>> unfold(pos, face, up, np.array([True, True, True, False]), pos, np.full(4, 2.0))[3]
        array([1., 1., 0.])
    """
    opened = pos.copy()
    for _ in range(_MOST_ROUNDS):
        folded = _folded(opened, face, normal)
        if not folded.any():
            break
        moving = np.zeros(len(pos), dtype=bool)
        moving[face[folded]] = True
        moving &= ~fixed
        near = moving[face].any(axis=1)
        step, axis, count = np.zeros_like(pos), np.zeros_like(pos), np.zeros((len(pos), 1))
        total = opened[face[near]].sum(axis=1)
        for corner in face[near].T:
            np.add.at(step, corner, total - 3 * opened[corner])  # to the two other corners
            np.add.at(axis, corner, normal[near])
            np.add.at(count, corner, 2)
        step, axis = step[moving] / count[moving], axis[moving]
        axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-12)
        opened[moving] += step - (step * axis).sum(axis=1, keepdims=True) * axis
    for stuck in (face[_folded(opened, face, normal)], np.linalg.norm(opened - origin, axis=1) > max_move):
        opened[stuck] = pos[stuck]
    revert_flips(opened, pos, face, normal)
    return opened


@njit(cache=True, nogil=True)
def _folded(pos: Floats, face: Ints, normal: Floats) -> Flags:
    """Mark the faces, (F,), that are flipped or about to be, and no lines."""
    folded = np.empty(len(face), dtype=np.bool_)
    for f in range(len(face)):
        x, y, z = _across(pos, face, f)
        steep = _STEEP * np.sqrt(x * x + y * y + z * z)
        folded[f] = _along(pos, face, normal, f) < steep and not _is_line(pos, face, f)
    return folded


@njit(cache=True, nogil=True)
def revert_flips(updated: Floats, before: Floats, face: Ints, normal: Floats) -> None:
    """Revert the vertices of the faces that an iteration has flipped, until there are no such faces."""
    reverted = True
    while reverted:  # each round reverts at least one more vertex
        reverted = False
        for f in range(len(face)):
            flipped = _along(updated, face, normal, f) <= 0 and _along(before, face, normal, f) > 0
            if flipped and not _is_line(before, face, f):  # a line has no side to lose
                for i in range(3):
                    v = face[f, i]
                    for axis in range(3):
                        updated[v, axis] = before[v, axis]
                reverted = True


@njit(cache=True, nogil=True)
def _is_line(pos: Floats, face: Ints, f: int) -> bool:
    """Whether the corners of face f lie on a line, up to the digits of float32."""
    uu = uw = ww = 0.0
    for axis in range(3):
        u = pos[face[f, 1], axis] - pos[face[f, 0], axis]
        w = pos[face[f, 2], axis] - pos[face[f, 0], axis]
        uu += u * u
        uw += u * w
        ww += w * w
    return uu * ww - uw * uw <= (_FLAT * (uu + ww)) ** 2


@njit(cache=True, nogil=True)
def _along(pos: Floats, face: Ints, normal: Floats, f: int) -> float:
    """Compute twice the area of face f projected along its normal; negative if it is seen from behind."""
    x, y, z = _across(pos, face, f)
    return normal[f, 0] * x + normal[f, 1] * y + normal[f, 2] * z


@njit(cache=True, nogil=True)
def _across(pos: Floats, face: Ints, f: int) -> tuple[float, float, float]:
    """Compute the cross product of two sides of face f."""
    a, b, c = face[f, 0], face[f, 1], face[f, 2]
    u_x, u_y, u_z = pos[b, 0] - pos[a, 0], pos[b, 1] - pos[a, 1], pos[b, 2] - pos[a, 2]
    w_x, w_y, w_z = pos[c, 0] - pos[a, 0], pos[c, 1] - pos[a, 1], pos[c, 2] - pos[a, 2]
    return u_y * w_z - u_z * w_y, u_z * w_x - u_x * w_z, u_x * w_y - u_y * w_x
