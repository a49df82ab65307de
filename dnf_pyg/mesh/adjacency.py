"""Adjacency of faces: around a vertex, across an edge, in the one-ring of a face; boundary vertices."""

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

__all__ = ["boundary_vertices", "edge_adjacent", "one_ring", "one_ring_csr", "vertex_faces"]

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
    the order of the file, so that time and memory stay in proportion to the mesh. The faces at a vertex stay connected.

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
def _one_ring_csr(
    face: NDArray[np.int64], vertex_ptr: NDArray[np.int64], face_id: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    num_faces = face.shape[0]
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
                    at = lo + np.searchsorted(face_id[lo:hi], f)
                    lo, hi = max(lo, at - _MAX_VALENCE // 2), min(hi, at + _MAX_VALENCE // 2 + 1)
                for entry in range(lo, hi):
                    g = face_id[entry]
                    if seen[g] != f:
                        seen[g] = f
                        if fill:
                            neighbor[end] = g
                        end += 1
            if fill:
                neighbor[begin:end].sort()
            ptr[f + 1] = end
    return ptr, neighbor
