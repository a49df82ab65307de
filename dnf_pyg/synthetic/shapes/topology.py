"""Edge splits, collapses and flips of a labelled mesh; compiled, arrays in and out.

A vertex may lie inside a surface, on a feature curve (an edge between two labels, or a boundary edge) or in a corner
where curves end or meet. Feature curves keep their shape: vertices merge only along them, and their edges do not
flip.
"""

import numpy as np
from numba import njit
from numpy import ndarray

from dnf_pyg.synthetic.shapes.incidence import (
    DEGREE,
    add_face,
    agreement,
    corner_angle,
    drop_face,
    edge_faces,
    edge_length,
    has_vertex,
    incidence,
    longest_edge,
    opposite,
)

__all__ = ["collapse_edges", "flip_edges", "split_edges"]


@njit(cache=True)
def split_edges(
    pos: ndarray, face: ndarray, label: ndarray, size: ndarray, factor: float
) -> tuple[ndarray, ndarray, ndarray, ndarray]:
    """Split edges longer than ``factor`` times the wanted size in the middle, until the mesh has four times the faces.

    Longer edges that remain need another call, since arrays cannot grow in compiled code.
    """
    num_vertices, num_faces = pos.shape[0], face.shape[0]
    pos, size = _grow(pos, 4 * num_vertices), np.append(size, np.zeros(3 * num_vertices))
    face, label = _grow(face, 4 * num_faces), np.append(label, np.zeros(3 * num_faces, dtype=np.int64))
    around, degree = incidence(face[:num_faces], pos.shape[0])
    f = 0
    while f < num_faces:
        i = longest_edge(pos, face[f])[0]
        u, v = face[f, i], face[f, (i + 1) % 3]
        count, first, second = edge_faces(face, around, degree, u, v)
        crowded = num_vertices + 1 > pos.shape[0] or num_faces + 2 > face.shape[0] or count > 2
        if crowded or edge_length(pos, u, v) <= factor * (size[u] + size[v]) / 2:
            f += 1
            continue
        full = False
        for k in range(count):
            full = full or degree[opposite(face, first if k == 0 else second, u, v)] + 1 >= DEGREE
        if full:
            f += 1
            continue
        middle = num_vertices
        num_vertices += 1
        pos[middle] = (pos[u] + pos[v]) / 2
        size[middle] = (size[u] + size[v]) / 2
        for k in range(count):
            old = first if k == 0 else second
            new = num_faces
            num_faces += 1
            face[new], label[new] = face[old], label[old]
            for j in range(3):
                if face[old, j] == v:
                    face[old, j] = middle
                if face[new, j] == u:
                    face[new, j] = middle
            drop_face(around, degree, v, old)
            add_face(around, degree, v, new)
            add_face(around, degree, opposite(face, old, u, middle), new)
            add_face(around, degree, middle, old)
            add_face(around, degree, middle, new)
    return pos[:num_vertices], face[:num_faces], label[:num_faces], size[:num_vertices]


@njit(cache=True)
def collapse_edges(
    pos: ndarray, face: ndarray, label: ndarray, normal: ndarray, size: ndarray, order: ndarray, factor: float
) -> ndarray:
    """Merge the ends of edges that are short, or belong to a turned face; True for the faces that stay.

    Short means less than ``factor`` times the wanted size. ``normal`` (F, 3) is the surface's normal at each face: a
    collapse must not turn a face by more than 45 degrees from it, unless it was turned more before. ``order`` is the
    order in which faces offer their edges. ``face`` changes in place.
    """
    around, degree = incidence(face, pos.shape[0])
    alive = np.ones(face.shape[0], dtype=np.bool_)
    for f in order:
        for i in range(3):
            if not alive[f]:
                break
            u, v = face[f, i], face[f, (i + 1) % 3]
            turned = agreement(pos, face[f], normal[f]) < 0.5
            if not turned and edge_length(pos, u, v) >= factor * (size[u] + size[v]) / 2:
                continue
            if not _may_collapse(pos, face, label, normal, size, around, degree, u, v):
                u, v = v, u
                if not _may_collapse(pos, face, label, normal, size, around, degree, u, v):
                    continue
            for k in range(degree[u]):
                g = around[u, k]
                if has_vertex(face, g, v):
                    alive[g] = False
                    for j in range(3):
                        if face[g, j] != u:
                            drop_face(around, degree, face[g, j], g)
                else:
                    for j in range(3):
                        if face[g, j] == u:
                            face[g, j] = v
                    add_face(around, degree, v, g)
            degree[u] = 0
    return alive


@njit(cache=True)
def flip_edges(pos: ndarray, face: ndarray, label: ndarray, normal: ndarray, num_sweeps: int) -> int:
    """Flip edges inside a surface whose opposite angles sum to over 180 degrees; ``face`` changes in place."""
    around, degree = incidence(face, pos.shape[0])
    flipped = 0
    for _ in range(num_sweeps):
        before = flipped
        for f in range(face.shape[0]):
            for i in range(3):
                u, v = face[f, i], face[f, (i + 1) % 3]
                count, first, second = edge_faces(face, around, degree, u, v)
                if count != 2 or label[first] != label[second]:
                    continue
                g = second if first == f else first
                a, b = opposite(face, f, u, v), opposite(face, g, u, v)
                if a == b or corner_angle(pos, u, a, v) + corner_angle(pos, u, b, v) <= np.pi + 1e-6:
                    continue
                if degree[u] <= 3 or degree[v] <= 3 or max(degree[a], degree[b]) + 1 >= DEGREE:
                    continue
                if edge_faces(face, around, degree, a, b)[0] > 0:
                    continue
                old = min(agreement(pos, face[f], normal[f]), agreement(pos, face[g], normal[g]))
                one, two = np.array([a, u, b]), np.array([b, v, a])
                new = min(agreement(pos, one, normal[f]), agreement(pos, two, normal[g]))
                if new < min(0.99, old):
                    continue
                face[f], face[g] = one, two
                drop_face(around, degree, v, f)
                drop_face(around, degree, u, g)
                add_face(around, degree, b, f)
                add_face(around, degree, a, g)
                flipped += 1
                break
        if flipped == before:
            break
    return flipped


@njit(cache=True)
def _may_collapse(pos, face, label, normal, size, around, degree, u, v) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    count, first, second = edge_faces(face, around, degree, u, v)
    if count == 0 or count > 2 or degree[u] + degree[v] >= DEGREE:
        return False
    on_curve = count == 1 or label[first] != label[second]
    features = _num_features(face, label, around, degree, u)
    if features != 0 and not (features == 2 and on_curve):
        return False
    common = 0
    for k in range(degree[u]):  # link condition: only the corners across the edge are neighbours of both ends
        for j in range(3):
            w = face[around[u, k], j]
            if w != u and w != v and edge_faces(face, around, degree, w, v)[0] > 0:
                common += 1
    inner = 0
    for k in range(count):
        w = opposite(face, first if k == 0 else second, u, v)
        inner += edge_faces(face, around, degree, u, w)[0]
        if (
            edge_faces(face, around, degree, u, w)[0] + edge_faces(face, around, degree, v, w)[0] == 2
            and degree[w] <= 1
        ):
            return False
        if degree[w] <= 3 and count == 2 and _num_features(face, label, around, degree, w) == 0:
            return False
    if common != inner:
        return False
    for k in range(degree[u]):
        g = around[u, k]
        if has_vertex(face, g, v):
            continue
        moved = face[g].copy()
        for j in range(3):
            if moved[j] == u:
                moved[j] = v
            elif edge_length(pos, face[g, j], v) > 1.4 * (size[v] + size[face[g, j]]) / 2:
                return False
        if agreement(pos, moved, normal[g]) < min(0.7071, agreement(pos, face[g], normal[g])):
            return False
    return True


@njit(cache=True)
def _num_features(face, label, around, degree, u) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    twice = 0  # inner edges are met from both of their faces
    for k in range(degree[u]):
        for j in range(3):
            w = face[around[u, k], j]
            if w != u:
                count, first, second = edge_faces(face, around, degree, u, w)
                if count == 1:
                    twice += 2
                elif count > 2 or label[first] != label[second]:
                    twice += 1
    return twice // 2


@njit(cache=True)
def _grow(rows, length):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    out = np.zeros((length, rows.shape[1]), dtype=rows.dtype)
    out[: rows.shape[0]] = rows
    return out
