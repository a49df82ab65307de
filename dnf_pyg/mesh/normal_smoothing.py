"""Smoothing of filtered facet normals where they vary no more than a filter errs."""

import math
from functools import cache

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

_NUM_ITERATIONS, _NUM_WIDE = 8, 1024  # iterations of the narrow and of the wide filter
_RANGE = 5.0  # in median differences of a face to those around it
_LEAST, _MOST = 0.05, 0.5  # limits of the range: 3 and 29 degrees
_DETAIL = 5.0  # in medians of what smoothing changes: more is detail, whatever the tolerance
_TINY = 1e-12  # tolerance where smoothing changes nothing, in place of 0
_FEW = 0.1  # share of a mesh that is smooth: with less, the wide filter is not worth its time
_CURVED = 2.0  # weight of differences from face to face: where a surface curves, a wide mean is off by about as much
_SMALL = 1e-3  # coefficients of Chebyshev polynomials that are left out


def smooth_normals(
    normal: Tensor, area: Tensor, topology: Topology, tolerance: float, wide_tolerance: float = 0.0
) -> Tensor:
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

    What is left on flat parts are errors that are alike over many faces. A wide filter averages them, with 1024
    iterations in place of 8, where :math:`d_i` is below a second tolerance. It is biased where the surface curves, so
    twice the mean difference of :math:`\mathbf{s}_i` from its ring is added to :math:`d_i`. A power of :math:`S` is a
    sum of Chebyshev polynomials, :math:`S^n = \mathrm{E}[T_{\vert K \vert}(S)]` with the place :math:`K` of a random
    walk after n steps, so about :math:`4 \sqrt n` products with :math:`S` are enough.
    Source: Zheng et al. 2011 (bilateral normal filtering); Tukey 1977, "Exploratory data analysis" (twicing).
    Differs: the range and the share that is taken; Li et al. 2020 do not smooth filtered normals.

    Args:
        normal: Filtered normals, (F, 3), unit length.
        area: Face areas, (F,), any unit.
        topology: Connectivity of the mesh.
        tolerance: Angle, in degrees, by which the normals of a smooth surface may differ from their smoothed version.
        wide_tolerance: The same for the wide filter; 0 to do without it.

    Returns:
        Normals, (F, 3), unit length, of the dtype and device of ``normal``.

    Raises:
        ValueError: If a tolerance is negative or not finite.

    Example:
        >>> topology = Topology(torch.tensor([[0, 1], [1, 3], [2, 2]]), num_vertices=4)
        >>> normal = torch.nn.functional.normalize(torch.tensor([[0.0, 0, 1], [0.02, 0, 1]]), dim=1)
        >>> smooth_normals(normal, torch.ones(2), topology, tolerance=3.0)[:, 0]
        tensor([0.0096, 0.0104])
    """
    for name, angle in (("tolerance", tolerance), ("wide_tolerance", wide_tolerance)):
        if not 0 <= angle < math.inf:
            raise ValueError(f"Expected '{name}' of at least 0 degrees (got {angle}). Use 0 for no smoothing.")
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
        math.radians(wide_tolerance),
        _coefficients(_NUM_WIDE),
    )
    return torch.from_numpy(found).to(normal)


@cache
def _coefficients(power: int) -> Floats:
    """Write ``2 x**power - x**(2 * power)``, a filter with twicing, as a sum of Chebyshev polynomials."""
    coefficients = np.zeros(2 * power + 1)
    for n, factor in ((power, 2), (2 * power, -1)):
        walks, all_walks = 1, 2**n
        for down in range(n + 1):  # number of steps of the random walk that go down
            coefficients[abs(n - 2 * down)] += factor * (walks / all_walks)
            walks = walks * (n - down) // (down + 1)  # many times faster than math.comb for each
    kept = coefficients[: np.flatnonzero(abs(coefficients) > _SMALL)[-1] + 1]
    return kept / kept.sum()


@njit(cache=True, nogil=True)
def _smoothed(
    normal: Floats, area: Floats, ptr: Ints, ring: Shorts, tolerance: float, wide_tolerance: float, wide: Floats
) -> Floats:
    own, weight = _weights(normal, area, ptr, ring)
    once = _filtered(normal, normal, ptr, ring, own, weight)
    smooth = 2 * once - _filtered(once, normal, ptr, ring, own, weight)
    detail = _differences(smooth, normal, area, ptr, ring)
    found = _blended(normal, smooth, detail, tolerance)
    if wide_tolerance == 0 or np.exp(-((detail / wide_tolerance) ** 2)).mean() < _FEW:
        return found
    own, weight = _weights(found, area, ptr, ring)
    smooth = _polynomial(found, wide, ptr, ring, own, weight)
    detail = _differences(smooth, normal, area, ptr, ring) + _CURVED * _variation(smooth, ptr, ring, weight)
    return _blended(found, smooth, detail, wide_tolerance)


@njit(cache=True, nogil=True)
def _differences(smooth: Floats, normal: Floats, area: Floats, ptr: Ints, ring: Shorts) -> Floats:
    """Make the rows of ``smooth`` unit normals, and average their distances from ``normal`` over two rings."""
    _make_unit(smooth, normal)
    detail = np.zeros(len(normal))
    for f in range(len(normal)):
        detail[f] = np.sqrt(((smooth[f] - normal[f]) ** 2).sum())
    for _ in range(2):
        detail = _ring_means(detail, area, ptr, ring)
    return detail


@njit(cache=True, nogil=True)
def _variation(normal: Floats, ptr: Ints, ring: Shorts, weight: Floats) -> Floats:
    """Weighted mean of the distances of each normal from those of its ring."""
    variation = np.zeros(len(normal))
    for f in range(len(normal)):
        for entry in range(ptr[f], ptr[f + 1]):
            variation[f] += weight[entry] * np.sqrt(square_distance(normal, f, ring[entry]))
    return variation


@njit(cache=True, nogil=True)
def _blended(normal: Floats, smooth: Floats, detail: Floats, tolerance: float) -> Floats:
    """Take the share of ``smooth`` that falls with the detail of a face."""
    tolerance = max(min(tolerance, _DETAIL * np.median(detail)), _TINY)
    blend = np.empty_like(normal)
    for f in range(len(normal)):
        blend[f] = normal[f] + np.exp(-((detail[f] / tolerance) ** 2)) * (smooth[f] - normal[f])
    _make_unit(blend, normal)
    return blend


@njit(cache=True, nogil=True)
def _make_unit(vector: Floats, otherwise: Floats) -> None:
    for f in range(len(vector)):
        set_unit(vector, f, vector[f, 0], vector[f, 1], vector[f, 2], otherwise)


@njit(cache=True, nogil=True)
def _weights(normal: Floats, area: Floats, ptr: Ints, ring: Shorts) -> tuple[Floats, Floats]:
    """Weights of each face and of each entry of its ring, which add up to 1."""
    num_faces = len(normal)
    reach, own, weight = np.empty(num_faces), np.ones(num_faces), np.empty(len(ring))
    for f in range(num_faces):
        differences = np.zeros(ptr[f + 1] - ptr[f] + 1)  # the first is that of the face to itself
        for entry in range(ptr[f], ptr[f + 1]):
            differences[entry - ptr[f] + 1] = np.sqrt(square_distance(normal, f, ring[entry]))
        reach[f] = min(max(_RANGE * np.median(differences), _LEAST), _MOST)
    for f in range(num_faces):
        for entry in range(ptr[f], ptr[f + 1]):
            g = ring[entry]
            weight[entry] = area[g] * np.exp(-square_distance(normal, f, g) / min(reach[f], reach[g]) ** 2)
        total = area[f] + weight[ptr[f] : ptr[f + 1]].sum()
        if total > 0:
            own[f] = area[f] / total
            weight[ptr[f] : ptr[f + 1]] /= total
    return own, weight


@njit(cache=True, nogil=True)
def _filtered(start: Floats, normal: Floats, ptr: Ints, ring: Shorts, own: Floats, weight: Floats) -> Floats:
    """Iterate the mean over each face and its ring; a mean of no length leaves the normal as it is."""
    smooth = start
    for _ in range(_NUM_ITERATIONS):
        before, smooth = smooth, np.zeros_like(normal)
        _add_means(before, smooth, 1.0, ptr, ring, own, weight)
        _make_unit(smooth, normal)
    return smooth


@njit(cache=True, nogil=True)
def _polynomial(normal: Floats, coefficients: Floats, ptr: Ints, ring: Shorts, own: Floats, weight: Floats) -> Floats:
    """Sum of Chebyshev polynomials of the mean over each face and its ring."""
    last, this = normal.copy(), np.zeros_like(normal)
    _add_means(last, this, 1.0, ptr, ring, own, weight)
    total = coefficients[0] * last + coefficients[1] * this
    for coefficient in coefficients[2:]:
        for f in range(len(last)):
            for axis in range(3):
                last[f, axis] = -last[f, axis]
        _add_means(this, last, 2.0, ptr, ring, own, weight)  # T_k = 2 S T_(k-1) - T_(k-2)
        last, this = this, last
        if coefficient != 0:
            for f in range(len(this)):
                for axis in range(3):
                    total[f, axis] += coefficient * this[f, axis]
    return total


@njit(cache=True, nogil=True)
def _add_means(
    vector: Floats, out: Floats, factor: float, ptr: Ints, ring: Shorts, own: Floats, weight: Floats
) -> None:
    """Add multiples of the weighted means over each face and its ring."""
    for f in range(len(vector)):
        x, y, z = own[f] * vector[f, 0], own[f] * vector[f, 1], own[f] * vector[f, 2]
        for entry in range(ptr[f], ptr[f + 1]):
            g, w = ring[entry], weight[entry]
            x += w * vector[g, 0]
            y += w * vector[g, 1]
            z += w * vector[g, 2]
        out[f, 0] += factor * x
        out[f, 1] += factor * y
        out[f, 2] += factor * z


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
