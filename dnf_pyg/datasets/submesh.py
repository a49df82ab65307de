"""The faces and vertices that the facet normals of a patch depend on."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["surroundings"]

Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]


@njit(cache=True, nogil=True)
def surroundings(
    face: Shorts, ring_ptr: Ints, ring: Shorts, face_id: Ints, num_vertices: int
) -> tuple[Ints, Ints, Ints]:
    """Cut out a patch with the faces around it, so that all faces at each vertex of the patch are present.

    Args:
        face: Vertices of each face of the mesh, shape (F, 3).
        ring_ptr: Row limits of ``ring``, shape (F + 1,).
        ring: One-rings of the faces, one after the other.
        face_id: Faces of the patch, shape (N,).
        num_vertices: Vertices of the mesh V.

    Returns:
        ``(vertex_id, corner, member)``: rows of the vertices in the mesh, shape (W,); vertices of each face, rows of
        ``vertex_id``, shape (3, M), the faces of the patch first; rows of these faces in the mesh, shape (M,).
    """
    taken = np.zeros(len(face), np.bool_)
    most = len(face_id)
    for f in face_id:
        taken[f] = True
        most += ring_ptr[f + 1] - ring_ptr[f]
    member = np.empty(most, np.int64)
    member[: len(face_id)] = face_id
    end = len(face_id)
    for f in face_id:
        for g in ring[ring_ptr[f] : ring_ptr[f + 1]]:
            if not taken[g]:
                taken[g] = True
                member[end] = g
                end += 1
    place = np.full(num_vertices, -1, np.int64)
    vertex_id = np.empty(3 * end, np.int64)
    corner = np.empty((3, end), np.int64)
    count = 0
    for column in range(end):
        for row in range(3):
            v = face[member[column], row]
            if place[v] < 0:
                place[v] = count
                vertex_id[count] = v
                count += 1
            corner[row, column] = place[v]
    return vertex_id[:count].copy(), corner, member[:end].copy()
