"""Facets of a curved surface: how far they are tilted against it, and means over them that suit any triangulation."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import face_areas
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vectors import difference_along, tangent_axes

__all__ = ["FaceRings", "face_rings", "fit_to_triangulation", "tilts"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]

_RIDGE = 1e-3  # of the squared offsets in a ring: a ring along a line tells nothing about the direction across
_STEEPEST = 0.3  # tilt of a facet, as a slope
_MOST = 3.0  # factor of a weight


class FaceRings(NamedTuple):
    """Faces and the faces around each of them, for compiled loops."""

    area: Floats  # (F,), relative to the largest
    center: Floats  # centroids, (F, 3)
    corner: Floats  # (3 F, 3)
    ptr: Ints  # (F + 1,)
    neighbor: Shorts  # those of face f are neighbor[ptr[f]:ptr[f + 1]]


def face_rings(pos: Tensor, topology: Topology) -> FaceRings:
    """Collect what is needed of a mesh.

    Args:
        pos: Vertex positions, (V, 3), double precision.
        topology: Connectivity of the mesh.
    """
    area, corner = face_areas(pos, topology.face), pos[topology.face.t()]
    relative = area / (area.max() or 1.0)
    return FaceRings(relative.numpy(), corner.mean(dim=1).numpy(), corner.reshape(-1, 3).numpy(), *topology.one_ring())


@njit(cache=True, nogil=True)
def tilts(normal: Floats, rings: FaceRings, weight: Floats) -> Floats:
    r"""Tilt of each facet against the smooth surface through its corners.

    Let a surface have the normals :math:`\mathbf{n}_i + \mathbf{H}_i \mathbf{u}` at the offset :math:`\mathbf{u}` from
    the centroid of face i, in the tangent plane. The height of the surface at the corners
    :math:`\mathbf{p}_0, \mathbf{p}_1, \mathbf{p}_2` of the face makes its facet normal differ from
    :math:`\mathbf{n}_i` by

    .. math::
        \mathbf{t}_i = \sum_k \frac{\mathbf{p}_k^\top \mathbf{H}_i \mathbf{p}_k}{2} \nabla \varphi_k

    with the linear functions :math:`\varphi_k` that are 1 at a corner and 0 at the others. Obtuse triangles are tilted
    most. The symmetric matrix :math:`\mathbf{H}_i` is fitted to the normals of the ring by least squares.

    Args:
        normal: Normals of the surface at the centroids, (F, 3), unit length.
        rings: The faces.
        weight: Weight of each neighbour, like ``rings.neighbor``.

    Returns:
        Tilts, (F, 3), orthogonal to the normals; zero where a ring or a triangle has no extent.
    """
    ptr, neighbor, center, corner = rings.ptr, rings.neighbor, rings.center, rings.corner
    tilt = np.zeros_like(normal)
    for f in range(len(normal)):
        x, y = tangent_axes(normal, f)
        uu, uv, vv = _moments(x, y, f, rings, weight)
        up = uq_vp = vq = 0.0
        for entry in range(ptr[f], ptr[f + 1]):
            g, w = neighbor[entry], weight[entry]
            u, v = difference_along(x, center, f, g), difference_along(y, center, f, g)
            p, q = difference_along(x, normal, f, g), difference_along(y, normal, f, g)
            up, uq_vp, vq = up + w * u * p, uq_vp + w * (u * q + v * p), vq + w * v * q
        u1, v1 = difference_along(x, corner, 3 * f, 3 * f + 1), difference_along(y, corner, 3 * f, 3 * f + 1)
        u2, v2 = difference_along(x, corner, 3 * f, 3 * f + 2), difference_along(y, corner, 3 * f, 3 * f + 2)
        double_area = u1 * v2 - u2 * v1
        if double_area <= 0 or uu + vv == 0:
            continue
        b = (uq_vp - uv * (up / uu + vq / vv)) / (uu + vv - uv * uv * (1 / uu + 1 / vv))
        a, c = (up - uv * b) / uu, (vq - uv * b) / vv  # H = [[a, b], [b, c]]
        u0, v0 = -(u1 + u2) / 3, -(v1 + v2) / 3  # the first corner, from the centroid
        height = _quadratic(a, b, c, u0, v0)
        first, second = _quadratic(a, b, c, u0 + u1, v0 + v1) - height, _quadratic(a, b, c, u0 + u2, v0 + v2) - height
        along_x, along_y = (first * v2 - second * v1) / double_area, (second * u1 - first * u2) / double_area
        scale = _STEEPEST / max(np.hypot(along_x, along_y), _STEEPEST)
        for axis in range(3):
            tilt[f, axis] = scale * (along_x * x[axis] + along_y * y[axis])
    return tilt


@njit(cache=True, nogil=True)
def fit_to_triangulation(normal: Floats, rings: FaceRings, own: Floats, weight: Floats) -> None:
    r"""Change the weights of means over each face and its ring so that they keep what varies linearly.

    Where the triangles on one side are larger, the weighted mean :math:`\bar{\mathbf{u}}_i` of the offsets of their
    centroids is not zero, and iterated means drift. The factors :math:`1 - \mathbf{g}_i^\top \mathbf{u}_{ij}` with
    :math:`\mathbf{g}_i = \overline{\mathbf{u} \mathbf{u}^\top}_i^{-1} \bar{\mathbf{u}}_i` make it zero, as local linear
    regression does. They are limited to 0 to 3, so the weights stay those of a mean.

    Args:
        normal: Normals at the centroids, (F, 3), unit length.
        rings: The faces.
        own: Weight of each face, (F,), which is changed.
        weight: Weight of each neighbour, like ``rings.neighbor``, which is changed.
    """
    ptr, neighbor, center = rings.ptr, rings.neighbor, rings.center
    for f in range(len(normal)):
        x, y = tangent_axes(normal, f)
        uu, uv, vv = _moments(x, y, f, rings, weight)
        if uu + vv == 0:
            continue
        mean_u = mean_v = 0.0
        for entry in range(ptr[f], ptr[f + 1]):
            g, w = neighbor[entry], weight[entry]
            u, v = difference_along(x, center, f, g), difference_along(y, center, f, g)
            mean_u, mean_v = mean_u + w * u, mean_v + w * v
        determinant = uu * vv - uv * uv
        slope_u = (vv * mean_u - uv * mean_v) / determinant
        slope_v = (uu * mean_v - uv * mean_u) / determinant
        total = own[f]
        for entry in range(ptr[f], ptr[f + 1]):
            g = neighbor[entry]
            u, v = difference_along(x, center, f, g), difference_along(y, center, f, g)
            weight[entry] *= min(max(1 - slope_u * u - slope_v * v, 0.0), _MOST)
            total += weight[entry]
        if total > 0:
            own[f] /= total
            weight[ptr[f] : ptr[f + 1]] /= total


@njit(cache=True, nogil=True)
def _moments(x: Floats, y: Floats, f: int, rings: FaceRings, weight: Floats) -> tuple[float, float, float]:
    """Second moments of the offsets of a ring along two axes, with the ridge on the diagonal."""
    uu = uv = vv = 0.0
    for entry in range(rings.ptr[f], rings.ptr[f + 1]):
        g, w = rings.neighbor[entry], weight[entry]
        u, v = difference_along(x, rings.center, f, g), difference_along(y, rings.center, f, g)
        uu, uv, vv = uu + w * u * u, uv + w * u * v, vv + w * v * v
    ridge = _RIDGE * (uu + vv)
    return uu + ridge, uv, vv + ridge


@njit(cache=True, nogil=True)
def _quadratic(a: float, b: float, c: float, u: float, v: float) -> float:
    return 0.5 * (a * u * u + 2 * b * u * v + c * v * v)
