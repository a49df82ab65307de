"""Smoothing of filtered facet normals where they vary no more than a filter errs."""

import math

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vectors import set_unit, square_distance

__all__ = ["smooth_normals"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]

_NUM_ITERATIONS = 8
_RANGE = 5.0  # in median differences of a face to those around it
_LEAST, _MOST = 0.05, 0.5  # limits of the range: 3 and 29 degrees
_DETAIL = 5.0  # in medians of what smoothing changes: more is detail, whatever the tolerance
_TINY = 1e-12  # tolerance where smoothing changes nothing, in place of 0


def smooth_normals(normal: Tensor, area: Tensor, topology: Topology, tolerance: float) -> Tensor:
    r"""Smooth facet normals where they vary by no more than a tolerance.

    A network errs a little differently on each face. Where the surface is smooth, these errors are all that varies
    between neighbouring faces, and they average out. An iteration of a bilateral filter over the faces
    :math:`\mathcal{N}(i)` that share a vertex with face i, itself included, is

    .. math::
        S(\mathbf{s})_i \propto \sum_{j \in \mathcal{N}(i)} a_j
            \exp \left( -\Vert \mathbf{n}_i - \mathbf{n}_j \Vert^2 / \min(r_i, r_j)^2 \right) \mathbf{s}_j.

    The range :math:`r_i` is five times the median of :math:`\Vert \mathbf{n}_i - \mathbf{n}_j \Vert`, so it follows the
    curvature, but not a sharp edge. Many iterations flatten the bumps of a smooth surface. As many again tell by how
    much, and give it back, which is known as twicing:

    .. math::
        \mathbf{s} \propto 2 \, S^{8}(\mathbf{n}) - S^{16}(\mathbf{n}), \qquad
        \mathbf{n}'_i \propto \mathbf{n}_i + e^{-(d_i / d)^2} (\mathbf{s}_i - \mathbf{n}_i).

    How much of the difference is taken depends on :math:`d_i`, the mean of :math:`\Vert \mathbf{s} - \mathbf{n} \Vert`
    over the two rings around face i: detail differs from its smoothed version by more than the tolerance :math:`d`, and
    stays. The tolerance is at most five times the median of :math:`d_i`: on a mesh that is flat for the most part, even
    smaller differences are detail.
    Source: Zheng et al. 2011 (bilateral normal filtering); Tukey 1977, "Exploratory data analysis" (twicing).
    Differs: the range and the share that is taken; Li et al. 2020 do not smooth filtered normals.

    Args:
        normal: Filtered normals, (F, 3), unit length.
        area: Face areas, (F,), any unit.
        topology: Connectivity of the mesh.
        tolerance: Angle, in degrees, by which the normals of a smooth surface may differ from their smoothed version.

    Returns:
        Normals, (F, 3), unit length, of the dtype and device of ``normal``.

    Raises:
        ValueError: If ``tolerance`` is negative or not finite.

    Example:
        >>> topology = Topology(torch.tensor([[0, 1], [1, 3], [2, 2]]), num_vertices=4)
        >>> normal = torch.nn.functional.normalize(torch.tensor([[0.0, 0, 1], [0.02, 0, 1]]), dim=1)
        >>> smooth_normals(normal, torch.ones(2), topology, tolerance=3.0)[:, 0]
        tensor([0.0096, 0.0104])
    """
    if not 0 <= tolerance < math.inf:
        raise ValueError(f"Expected 'tolerance' of at least 0 degrees (got {tolerance}). Use 0 for no smoothing.")
    if tolerance == 0 or len(normal) == 0:
        return normal
    ptr, ring = topology.one_ring()
    size = area.detach().cpu().double()
    found = _smoothed(
        normal.detach().cpu().double().contiguous().numpy(),
        (size / (size.max() or 1.0)).numpy(),
        ptr,
        ring,
        math.radians(tolerance),
    )
    return torch.from_numpy(found).to(normal)


@njit(cache=True, nogil=True)
def _smoothed(normal: Floats, area: Floats, ptr: Ints, ring: Shorts, tolerance: float) -> Floats:
    weight = _weights(normal, area, ptr, ring)
    once = _filtered(normal, normal, area, ptr, ring, weight)
    twice = _filtered(once, normal, area, ptr, ring, weight)
    smooth, detail = 2 * once - twice, np.zeros(len(normal))
    _make_unit(smooth, normal)
    for f in range(len(normal)):
        for axis in range(3):
            detail[f] += (smooth[f, axis] - normal[f, axis]) ** 2
    detail = np.sqrt(detail)
    for _ in range(2):
        detail = _ring_means(detail, area, ptr, ring)
    tolerance = max(min(tolerance, _DETAIL * np.median(detail)), _TINY)
    for f in range(len(normal)):
        share = np.exp(-((detail[f] / tolerance) ** 2))
        for axis in range(3):
            smooth[f, axis] = normal[f, axis] + share * (smooth[f, axis] - normal[f, axis])
    _make_unit(smooth, normal)
    return smooth


@njit(cache=True, nogil=True)
def _make_unit(vector: Floats, otherwise: Floats) -> None:
    for f in range(len(vector)):
        set_unit(vector, f, vector[f, 0], vector[f, 1], vector[f, 2], otherwise)


@njit(cache=True, nogil=True)
def _weights(normal: Floats, area: Floats, ptr: Ints, ring: Shorts) -> Floats:
    """Weight of each entry of the rings."""
    num_faces = len(normal)
    reach, weight = np.empty(num_faces), np.empty(len(ring))
    for f in range(num_faces):
        differences = np.zeros(ptr[f + 1] - ptr[f] + 1)  # the first is that of the face to itself
        for entry in range(ptr[f], ptr[f + 1]):
            differences[entry - ptr[f] + 1] = np.sqrt(square_distance(normal, f, ring[entry]))
        reach[f] = min(max(_RANGE * np.median(differences), _LEAST), _MOST)
    for f in range(num_faces):
        for entry in range(ptr[f], ptr[f + 1]):
            g = ring[entry]
            weight[entry] = area[g] * np.exp(-square_distance(normal, f, g) / min(reach[f], reach[g]) ** 2)
    return weight


@njit(cache=True, nogil=True)
def _filtered(start: Floats, normal: Floats, area: Floats, ptr: Ints, ring: Shorts, weight: Floats) -> Floats:
    """Iterate the weighted mean over each face and its ring; a mean of no length leaves the normal as it is."""
    smooth = start
    for _ in range(_NUM_ITERATIONS):
        before, smooth = smooth, np.empty_like(normal)
        for f in range(len(normal)):
            x, y, z = area[f] * before[f, 0], area[f] * before[f, 1], area[f] * before[f, 2]
            for entry in range(ptr[f], ptr[f + 1]):
                g = ring[entry]
                x += weight[entry] * before[g, 0]
                y += weight[entry] * before[g, 1]
                z += weight[entry] * before[g, 2]
            set_unit(smooth, f, x, y, z, normal)
    return smooth


@njit(cache=True, nogil=True)
def _ring_means(value: Floats, area: Floats, ptr: Ints, ring: Shorts) -> Floats:
    """Mean over each face and its ring, weighted by areas."""
    means = np.empty_like(value)
    for f in range(len(value)):
        total, weights = area[f] * value[f], area[f]
        for entry in range(ptr[f], ptr[f + 1]):
            g = ring[entry]
            total += area[g] * value[g]
            weights += area[g]
        means[f] = total / weights if weights > 0 else value[f]
    return means
