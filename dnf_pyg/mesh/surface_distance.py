"""Exact distance from points to the surface of a triangle mesh."""

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

__all__ = ["surface_distance"]

_LEAF = 4  # triangles per leaf of the tree of boxes
_BITS = 20  # of the position of a triangle on the curve, per axis

Floats = NDArray[np.float64]


def surface_distance(point: Tensor, pos: Tensor, face: Tensor) -> Tensor:
    """Compute the distance from each point to the nearest point of a surface, on a face, an edge or a vertex.

    The distance is exact up to rounding for faces of any size and shape, also those without area.

    Args:
        point: Points, shape (P, 3), model units.
        pos: Vertex positions of the surface, shape (V, 3), model units.
        face: Vertices of each of its faces, shape (3, F).

    Returns:
        Distances, shape (P,), model units, float64.

    Raises:
        ValueError: If the surface has no faces.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
        >>> surface_distance(torch.tensor([[1.0, 1, 2], [7, 0, 4]]), pos, torch.tensor([[0], [1], [2]]))
        tensor([2., 5.], dtype=torch.float64)
    """
    if face.size(1) == 0:
        raise ValueError("Expected 'face' with at least one face (got none). Measure to a mesh, not a point cloud.")
    corner = pos.detach().cpu().double()[face.cpu()].transpose(0, 1).contiguous().numpy()  # (F, 3 corners, 3)
    corner = corner[_along_curve(corner.mean(axis=1))]
    distance = _distances(point.detach().cpu().double().contiguous().numpy(), corner, _boxes(corner))
    return torch.from_numpy(distance)


def _along_curve(centroid: Floats) -> NDArray[np.int64]:
    """Sort centroids (F, 3) along a Morton curve, which keeps most neighbours in space together."""
    low = centroid.min(axis=0)
    extent = float((centroid.max(axis=0) - low).max()) or 1.0
    cell = np.minimum((centroid - low) / extent * 2**_BITS, 2**_BITS - 1).astype(np.int64)
    code = np.zeros(len(centroid), np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _boxes(corner: Floats) -> Floats:
    """Build a binary tree of boxes over consecutive triangles, (2 L, 2, 3): the children of node n are 2 n, 2 n + 1."""
    num_leaves = 1 << max(int(np.ceil(len(corner) / _LEAF)) - 1, 0).bit_length()
    box = np.empty((2 * num_leaves, 2, 3))
    box[:, 0], box[:, 1] = np.inf, -np.inf  # an empty box is infinitely far away
    first = np.arange(0, len(corner), _LEAF)
    box[num_leaves : num_leaves + len(first), 0] = np.minimum.reduceat(corner.min(axis=1), first)
    box[num_leaves : num_leaves + len(first), 1] = np.maximum.reduceat(corner.max(axis=1), first)
    level = num_leaves // 2
    while level:
        children = box[2 * level : 4 * level].reshape(level, 2, 2, 3)
        box[level : 2 * level, 0] = children[:, :, 0].min(axis=1)
        box[level : 2 * level, 1] = children[:, :, 1].max(axis=1)
        level //= 2
    return box


@njit(cache=True, nogil=True)
def _distances(point: Floats, corner: Floats, box: Floats) -> Floats:
    """Search the tree for the triangle nearest to each point, nearer child first."""
    num_leaves = len(box) // 2
    distance = np.empty(len(point))
    node_stack, square_stack = np.empty(64, np.int64), np.empty(64)
    for p in range(len(point)):
        best = np.inf
        node_stack[0], square_stack[0] = 1, 0.0
        top = 1
        while top:
            top -= 1
            node = node_stack[top]
            if square_stack[top] >= best:
                continue
            if node >= num_leaves:
                begin = (node - num_leaves) * _LEAF
                for f in range(begin, min(begin + _LEAF, len(corner))):
                    best = min(best, _to_triangle(point[p], corner[f]))
                continue
            near, far = _to_box(point[p], box[2 * node]), _to_box(point[p], box[2 * node + 1])
            nearer = 2 * node
            if far < near:
                near, far, nearer = far, near, 2 * node + 1
            if far < best:
                node_stack[top], square_stack[top] = 4 * node + 1 - nearer, far
                top += 1
            if near < best:
                node_stack[top], square_stack[top] = nearer, near
                top += 1
        distance[p] = np.sqrt(best)
    return distance


@njit(cache=True, nogil=True)
def _to_box(p: Floats, box: Floats) -> float:
    """Compute the squared distance to a box, zero inside."""
    square = 0.0
    for axis in range(3):
        outside = max(box[0, axis] - p[axis], p[axis] - box[1, axis], 0.0)
        square += outside * outside
    return square


@njit(cache=True, nogil=True)
def _to_triangle(p: Floats, corner: Floats) -> float:
    """Compute the squared distance to a triangle: to its plane above its interior, elsewhere to its nearest edge."""
    ux, uy, uz = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
    vx, vy, vz = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
    wx, wy, wz = p[0] - corner[0, 0], p[1] - corner[0, 1], p[2] - corner[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    if square > 0:
        b = ((wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz) / square
        c = ((uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz) / square
        if b >= 0 and c >= 0 and b + c <= 1:
            height = wx * nx + wy * ny + wz * nz
            return height * height / square
    return min(_to_edge(p, corner[0], corner[1]), _to_edge(p, corner[1], corner[2]), _to_edge(p, corner[2], corner[0]))


@njit(cache=True, nogil=True)
def _to_edge(p: Floats, a: Floats, b: Floats) -> float:
    """Compute the squared distance to the line segment from a to b."""
    along = length = 0.0
    for axis in range(3):
        along += (p[axis] - a[axis]) * (b[axis] - a[axis])
        length += (b[axis] - a[axis]) ** 2
    share = min(max(along / length, 0.0), 1.0) if length > 0 else 0.0
    square = 0.0
    for axis in range(3):
        square += (p[axis] - a[axis] - share * (b[axis] - a[axis])) ** 2
    return square
