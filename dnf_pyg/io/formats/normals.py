"""Normals that a mesh file stores, after its vertices have moved."""

import numpy as np

from dnf_pyg.io.formats.document import Floats, Ints
from dnf_pyg.mesh.weld import coincident_rows

__all__ = ["add_rows", "area_vectors", "moved_normals", "turned_normals"]


def moved_normals(normal: Floats, corner_normal: Ints, face: Ints, pos: Floats, new_pos: Floats) -> Floats:
    """Recompute the normals that a file stores after its vertices have moved.

    Faces share a normal where the file lets them: at the same place with the same stored normal, also across the seam
    of a texture. Hard edges thus stay hard, flat shading flat, and smooth shading smooth.

    Args:
        normal: Stored normals, (M, 3).
        corner_normal: Stored normal of each corner of each triangle, (F, 3).
        face: Vertices of each triangle, (F, 3).
        pos: Positions in the file, (V, 3).
        new_pos: New positions, (V, 3).

    Returns:
        Normals, (M, 3): area weighted and of unit length where a face around has moved, else the stored ones.
    """
    place = coincident_rows(pos)[0][face]
    value = coincident_rows(normal)[0][corner_normal]
    _, group = np.unique(place * (value.max(initial=0) + 1) + value, return_inverse=True)
    sums = []
    for where in (pos, new_pos):
        by_face = np.repeat(area_vectors(where, face), 3, axis=0)  # (3 F, 3)
        sums.append(add_rows(add_rows(by_face, group.ravel())[group.ravel()], corner_normal.ravel(), len(normal)))
    return turned_normals(normal, *sums)


def turned_normals(normal: Floats, before: Floats, after: Floats) -> Floats:
    """Replace stored normals whose faces have moved; those that point inwards stay so.

    Args:
        normal: Stored normals, (M, 3).
        before: Sum of the area vectors of the faces around each, (M, 3), in the file.
        after: The same after the move.

    Returns:
        Normals, (M, 3): of unit length where the sum has changed and is not zero, else the stored ones.
    """
    sign = np.where((before * normal).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    length = np.linalg.norm(after, axis=1, keepdims=True)
    changed = (before != after).any(axis=1, keepdims=True) & (length > 0)
    return np.where(changed, sign * after / np.where(length > 0, length, 1.0), normal)


def area_vectors(pos: Floats, face: Ints) -> Floats:
    """Normals of triangles, (F, 3), twice as long as their area."""
    a, b, c = pos[face].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def add_rows(rows: Floats, index: Ints, size: int | None = None) -> Floats:
    """Sum rows (N, 3) that have the same index (N,)."""
    size = int(index.max(initial=-1)) + 1 if size is None else size
    return np.stack([np.bincount(index, rows[:, axis], size) for axis in range(3)], axis=1)
