"""Adjacency of faces: around a vertex, across an edge, in the one-ring of a face; boundary vertices."""

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

__all__ = ["boundary_vertices", "edge_adjacent", "one_ring", "one_ring_csr", "opposite_half_edges", "vertex_faces"]

Ints = NDArray[np.int64]

_MAX_VALENCE = 64  # faces at a vertex or an edge; the pairs among more of them would grow with their square


def vertex_faces(face: Tensor, num_vertices: int) -> tuple[Tensor, Tensor]:
    """List the faces around each vertex.

    Args:
        face: Vertices of each face, shape (3, F).
        num_vertices: Number of vertices V.

    Returns:
        ``(ptr, face_id)``: faces of vertex v, in rising order, are ``face_id[ptr[v]:ptr[v + 1]]``; shapes
        (V + 1,) and (C,), where C is 3 F minus one for each face that names a vertex twice.

    Example:
        >>> vertex_faces(torch.tensor([[0, 1], [1, 3], [2, 2]]), num_vertices=4)
        (tensor([0, 1, 3, 5, 6]), tensor([0, 0, 1, 0, 1, 1]))
    """
    a, b, c = face
    keep = torch.stack([torch.ones_like(a, dtype=torch.bool), b != a, (c != a) & (c != b)])
    face_id = torch.arange(face.size(1), device=face.device).expand(3, -1)[keep]
    vertex, order = face[keep].sort(stable=True)
    face_id = face_id[order]
    code = (vertex * face.size(1) + face_id).sort().values  # rising face within a vertex
    ptr = torch.zeros(num_vertices + 1, dtype=torch.long, device=face.device)
    ptr[1:] = torch.bincount(vertex, minlength=num_vertices).cumsum(0)
    return ptr, code % max(face.size(1), 1)


def one_ring(face: Tensor, num_vertices: int) -> Tensor:
    """List the pairs of faces that share at least a vertex.

    Differs: at a vertex of more than 64 faces, each of them is paired only with the 32 before and the 32 after it in
    their order around the vertex, so that time and memory stay in proportion to the mesh. The faces at a vertex stay
    connected.

    Args:
        face: Vertices of each face, shape (3, F).
        num_vertices: Number of vertices V.

    Returns:
        Pairs, shape (2, E): neighbour in row 0, centre in row 1, sorted by centre, then neighbour; both
        directions, no face paired with itself.

    Example:
        >>> one_ring(torch.tensor([[0, 1], [1, 3], [2, 2]]), num_vertices=4)
        tensor([[1, 0],
                [0, 1]])
    """
    ptr, neighbor = one_ring_csr(face.cpu(), *vertex_faces(face.cpu(), num_vertices))
    centre = np.arange(face.size(1)).repeat(np.diff(ptr))
    return torch.from_numpy(np.stack([neighbor.astype(np.int64), centre])).to(face.device)


def edge_adjacent(face: Tensor) -> Tensor:
    """List the pairs of faces that share an edge.

    At an edge of three or more faces every two of them form a pair; so do duplicate faces.

    Differs: of more than 64 faces at one edge, each is paired only with the 63 before and after it in the file.

    Args:
        face: Vertices of each face, shape (3, F).

    Returns:
        Pairs, shape (2, E), in the form of :func:`one_ring`.

    Example:
        >>> edge_adjacent(torch.tensor([[0, 1, 3], [1, 3, 4], [2, 2, 5]]))
        tensor([[1, 0],
                [0, 1]])
    """
    num_faces = face.size(1)
    if num_faces == 0:
        return face.new_empty(2, 0)
    pair = torch.stack([face[[0, 1]], face[[1, 2]], face[[2, 0]]], dim=1).sort(dim=0).values  # (2, 3, F)
    code = (pair[0] * (int(face.max()) + 1) + pair[1]).flatten()
    owner = torch.arange(num_faces, device=face.device).repeat(3)
    real = (pair[0] != pair[1]).flatten()
    code, order = code[real].sort(stable=True)
    owner = owner[real][order]
    most = min(int(torch.unique_consecutive(code, return_counts=True)[1].max()), _MAX_VALENCE) if code.numel() else 0
    found = []
    for step in range(1, most):
        same = (code[step:] == code[:-step]) & (owner[step:] != owner[:-step])
        found += [torch.stack([owner[step:][same], owner[:-step][same]])]
    if not found:
        return face.new_empty(2, 0)
    both = torch.cat([torch.cat(found, dim=1), torch.cat(found, dim=1).flip(0)], dim=1)
    key = (both[1] * num_faces + both[0]).unique()
    return torch.stack([key % num_faces, key // num_faces])


def opposite_half_edges(face: Ints) -> tuple[Ints, Ints]:
    """List the edges that exactly two faces have, as the half-edges of these faces.

    Half-edge h belongs to face h % F and leads from the vertex in row h // F to that in the next row.

    Args:
        face: Vertices of each face, shape (3, F), array.

    Returns:
        Both half-edges of each edge, shape (E,) each, the one of the upper row of ``face`` first.

    Example:
        >>> opposite_half_edges(np.array([[0, 1], [1, 3], [2, 2]]))
        (array([2]), array([5]))
    """
    start, end = face.ravel(), np.roll(face, -1, axis=0).ravel()
    code = np.minimum(start, end) * (int(face.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(code, kind="stable")
    _, first, count = np.unique(code[order], return_index=True, return_counts=True)
    return order[first[count == 2]], order[first[count == 2] + 1]


def boundary_vertices(face: Tensor, num_vertices: int) -> Tensor:
    """Mark the vertices on an open boundary: those at an edge that only one face has.

    Args:
        face: Vertices of each face, shape (3, F).
        num_vertices: Number of vertices V.

    Returns:
        Mask, shape (V,), bool.

    Example:
        >>> boundary_vertices(torch.tensor([[0], [1], [2]]), num_vertices=4)
        tensor([ True,  True,  True, False])
    """
    mask = torch.zeros(num_vertices, dtype=torch.bool, device=face.device)
    pair = torch.cat([face[[0, 1]], face[[1, 2]], face[[2, 0]]], dim=1).sort(dim=0).values
    pair = pair[:, pair[0] != pair[1]]
    code, count = (pair[0] * num_vertices + pair[1]).unique(return_counts=True)
    single = code[count == 1]
    mask[single // num_vertices] = True
    mask[single % num_vertices] = True
    return mask


def one_ring_csr(face: Tensor, ptr: Tensor, face_id: Tensor) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """List the faces of each one-ring in compressed rows.

    Args:
        face: Vertices of each face, shape (3, F), on the CPU.
        ptr: Row limits of ``face_id``, shape (V + 1,).
        face_id: Faces around each vertex (:func:`vertex_faces`), shape (C,).

    Returns:
        ``(ptr, neighbor)``: neighbours of face f, in rising order, are ``neighbor[ptr[f]:ptr[f + 1]]``.
    """
    return _one_ring_csr(np.ascontiguousarray(face.t().numpy()), ptr.numpy(), face_id.numpy())


@njit(cache=True, nogil=True)
def _faces_in_turn(face: Ints, vertex_ptr: Ints, face_id: Ints) -> tuple[Ints, Ints]:
    """Order the faces at each vertex of very many around it; return them, and the new place of each entry."""
    if len(vertex_ptr) < 2 or np.max(np.diff(vertex_ptr)) <= _MAX_VALENCE:
        return face_id, face_id  # places are not looked up
    around, place = face_id.copy(), np.empty(len(face_id), np.int64)
    for v in range(len(vertex_ptr) - 1):
        lo, hi = vertex_ptr[v], vertex_ptr[v + 1]
        if hi - lo > _MAX_VALENCE:
            for at, entry in enumerate(_turn(face, v, face_id[lo:hi])):
                around[lo + at] = face_id[lo + entry]
                place[lo + entry] = lo + at
    return around, place


@njit(cache=True, nogil=True)
def _turn(face: Ints, v: int, face_id: Ints) -> Ints:
    """Walk from face to face around a vertex, across the edges that they share, and start anew where a walk ends."""
    count = len(face_id)
    rim = np.full(2 * count, v, np.int64)  # the other two vertices of each face; v itself if it is named twice
    for i in range(count):
        found = 0
        for w in face[face_id[i]]:
            if w != v:
                rim[2 * i + found] = w
                found += 1
    order = np.argsort(rim, kind="mergesort")
    number = np.empty(2 * count, np.int64)  # of the vertex of each entry of ``rim``
    begin = np.empty(2 * count + 1, np.int64)  # entries of vertex number g: order[begin[g]:end[g]]
    last = -1
    for at in range(2 * count):
        if at == 0 or rim[order[at]] != rim[order[at - 1]]:
            last += 1
            begin[last] = at
        number[order[at]] = last
    begin[last + 1] = 2 * count
    end = begin[1:].copy()
    out, filled, walked = np.empty(count, np.int64), 0, np.zeros(count, np.bool_)
    for first in range(count):
        if walked[first]:
            continue
        entry = 2 * first
        while True:
            walked[entry // 2] = True
            out[filled] = entry // 2
            filled += 1
            g = number[entry ^ 1]  # leave through the other vertex
            while begin[g] < end[g] and walked[order[begin[g]] // 2]:
                begin[g] += 1
            if begin[g] == end[g]:
                break
            entry = order[begin[g]]
    return out


@njit(cache=True, nogil=True)
def _one_ring_csr(face: Ints, vertex_ptr: Ints, face_id: Ints) -> tuple[Ints, NDArray[np.int32]]:
    num_faces = face.shape[0]
    around, place = _faces_in_turn(face, vertex_ptr, face_id)
    seen = np.full(num_faces, -1, np.int32)
    ptr = np.zeros(num_faces + 1, np.int64)
    neighbor = np.empty(0, np.int32)
    for fill in range(2):  # count, then fill
        seen[:] = -1
        if fill:
            neighbor = np.empty(ptr[num_faces], np.int32)
        end = 0
        for f in range(num_faces):
            begin = end
            seen[f] = f
            for corner in range(3):
                lo, hi = vertex_ptr[face[f, corner]], vertex_ptr[face[f, corner] + 1]
                if hi - lo > _MAX_VALENCE:
                    at = place[lo + np.searchsorted(face_id[lo:hi], f)]
                    lo, hi = max(lo, at - _MAX_VALENCE // 2), min(hi, at + _MAX_VALENCE // 2 + 1)
                for entry in range(lo, hi):
                    g = around[entry]
                    if seen[g] != f:
                        seen[g] = f
                        if fill:
                            neighbor[end] = g
                        end += 1
            if fill:
                neighbor[begin:end].sort()
            ptr[f + 1] = end
    return ptr, neighbor
