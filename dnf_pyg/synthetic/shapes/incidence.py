"""Faces around a vertex and at an edge, and measures of single faces; compiled code for :mod:`.topology`."""

import numpy as np
from numba import njit
from numpy import ndarray

__all__ = [
    "DEGREE",
    "add_face",
    "agreement",
    "corner_angle",
    "drop_face",
    "edge_faces",
    "edge_length",
    "has_vertex",
    "incidence",
    "longest_edge",
    "opposite",
]

DEGREE = 40  # largest number of faces around a vertex; collapses that would exceed it are skipped


@njit(cache=True)
def incidence(face: ndarray, num_vertices: int) -> tuple[ndarray, ndarray]:
    """Faces around each vertex: a table (V, 40) and the number used in each row."""
    around = np.full((num_vertices, DEGREE), -1, dtype=np.int64)
    degree = np.zeros(num_vertices, dtype=np.int64)
    for f in range(face.shape[0]):
        for i in range(3):
            add_face(around, degree, face[f, i], f)
    return around, degree


@njit(cache=True)
def edge_faces(face, around, degree, u, v) -> tuple[int, int, int]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Number of faces at the edge from u to v, and the first two of them, -1 where there are none."""
    count, first, second = 0, -1, -1
    for k in range(degree[u]):
        f = around[u, k]
        if face[f, 0] == v or face[f, 1] == v or face[f, 2] == v:
            if count == 0:
                first = f
            else:
                second = f
            count += 1
    return count, first, second


@njit(cache=True)
def opposite(face, f, u, v) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Corner of face f across the edge from u to v."""
    for j in range(3):
        if face[f, j] != u and face[f, j] != v:
            return face[f, j]
    return -1


@njit(cache=True)
def has_vertex(face, f, v) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Whether face f has vertex v."""
    return face[f, 0] == v or face[f, 1] == v or face[f, 2] == v


@njit(cache=True)
def add_face(around, degree, v, f) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Enter face f at vertex v."""
    around[v, degree[v]] = f
    degree[v] += 1


@njit(cache=True)
def drop_face(around, degree, v, f) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take face f off vertex v."""
    for k in range(degree[v]):
        if around[v, k] == f:
            degree[v] -= 1
            around[v, k] = around[v, degree[v]]
            return


@njit(cache=True)
def agreement(pos, corners, normal) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Cosine of the angle between a face of three corners and a normal; -1 for a face without area."""
    cross = np.cross(pos[corners[1]] - pos[corners[0]], pos[corners[2]] - pos[corners[0]])
    length = np.sqrt((cross * cross).sum())
    return (cross * normal).sum() / length if length > 1e-14 else -1.0


@njit(cache=True)
def corner_angle(pos, u, a, v) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Angle at a between u and v, radians."""
    one, two = pos[u] - pos[a], pos[v] - pos[a]
    cross = np.cross(one, two)
    return np.arctan2(np.sqrt((cross * cross).sum()), (one * two).sum())


@njit(cache=True)
def edge_length(pos, u, v) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Length of the edge from u to v."""
    return np.sqrt((pos[u, 0] - pos[v, 0]) ** 2 + (pos[u, 1] - pos[v, 1]) ** 2 + (pos[u, 2] - pos[v, 2]) ** 2)


@njit(cache=True)
def longest_edge(pos, corners) -> tuple[int, float]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Side of a face that is longest, and its length."""
    best, longest = 0, -1.0
    for i in range(3):
        length = edge_length(pos, corners[i], corners[(i + 1) % 3])
        if length > longest:
            best, longest = i, length
    return best, longest
