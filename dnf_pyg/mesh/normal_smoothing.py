"""Smoothing of filtered facet normals where they vary no more than a filter errs."""

import math
from functools import cache

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.facet_tilt import FaceRings, face_rings, fit_to_triangulation, tilts
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vectors import set_unit, square_distance

__all__ = ["smooth_normals"]

Floats = NDArray[np.float64]

_NARROW, _WIDE, _FLAT = 8, (16, 64), 1024  # iterations
_NUM_MEANS = 2  # of the narrow iterations, before the curvature is measured
_RANGE = 5.0  # in median differences of a face to those around it
_LEAST, _MOST = 0.05, 0.5  # limits of the range: 3 and 29 degrees
_DETAIL = 5.0  # in medians of what smoothing changes: more is detail, whatever the tolerance
_TINY = 1e-12  # tolerance where smoothing changes nothing, in place of 0
_FEW = 0.1  # share of a mesh that is smooth: with less, the wide filters are not worth their time
_CURVED = 2.0  # weight of differences from face to face: where a surface curves, a flat mean is off by about as much
_SMALL = 1e-3  # coefficients of Chebyshev polynomials that are left out


def smooth_normals(
    normal: Tensor, pos: Tensor, topology: Topology, tolerance: float, wide_tolerance: float = 0.0
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

    What is left are errors that are alike over many faces. Wider filters average them where they change the normals by
    less than a second tolerance. For smooth curved parts, there are two, with 16 and 64 iterations. Iterated means
    drift to where the triangles are larger; factors of the weights that depend on the triangulation prevent it, and
    give :math:`S_\triangle` (:func:`~dnf_pyg.mesh.facet_tilt.fit_to_triangulation`). Means would also even out the
    tilts :math:`\mathbf{t}` of the facets of a curved surface against it (:func:`~dnf_pyg.mesh.facet_tilt.tilts`), so
    these are removed before and given back afterwards:

    .. math::
        \mathbf{s} \propto (2 S_\triangle^m - S_\triangle^{2m})(\mathbf{n} - \mathbf{t}) + \mathbf{t}, \qquad
        m = 16, 64.

    A last filter, with 1024 iterations of the means above, is for flat parts alone. It is biased where the surface
    curves, so twice the mean difference of :math:`\mathbf{s}_i` from its ring is added to :math:`d_i`. A power of
    :math:`S` is a sum of Chebyshev polynomials, :math:`S^n = \mathrm{E}[T_{\vert K \vert}(S)]` with the place :math:`K`
    of a random walk after n steps, so about :math:`4 \sqrt n` products with :math:`S` are enough.
    Source: Zheng et al. 2011 (bilateral normal filtering); Tukey 1977, "Exploratory data analysis" (twicing); Cleveland
    1979 (local linear regression).
    Differs: the tilts, the range and the share that is taken; Li et al. 2020 do not smooth filtered normals.

    Args:
        normal: Filtered normals, (F, 3), unit length.
        pos: Vertex positions, (V, 3), any unit; noise along the normals matters little.
        topology: Connectivity of the mesh.
        tolerance: Angle, in degrees, by which the normals of a smooth surface may differ from their smoothed version.
        wide_tolerance: The same for the wider filters; 0 to do without them.

    Returns:
        Normals, (F, 3), unit length, of the dtype and device of ``normal``.

    Raises:
        ValueError: If a tolerance is negative or not finite.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
        >>> topology = Topology(torch.tensor([[0, 0, 0, 0], [1, 2, 3, 4], [2, 3, 4, 1]]), num_vertices=5)
        >>> normal = torch.tensor([[0.02, 0, 0.9998], [0, 0, 1], [0, 0, 1], [0, 0, 1]])
        >>> smooth_normals(normal, pos, topology, tolerance=3.0)[:, 0]
        tensor([0.0053, 0.0045, 0.0045, 0.0045])
    """
    for name, angle in (("tolerance", tolerance), ("wide_tolerance", wide_tolerance)):
        if not 0 <= angle < math.inf:
            raise ValueError(f"Expected '{name}' of at least 0 degrees (got {angle}). Use 0 for no smoothing.")
    if tolerance == 0 or len(normal) == 0:
        return normal
    found = _smoothed(
        normal.detach().cpu().double().contiguous().numpy(),
        face_rings(pos.detach().cpu().double(), topology),
        math.radians(tolerance),
        math.radians(wide_tolerance),
        tuple(map(_coefficients, _WIDE)),
        _coefficients(_FLAT),
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
    normal: Floats,
    rings: FaceRings,
    tolerance: float,
    wide_tolerance: float,
    curved: tuple[Floats, ...],
    flat: Floats,
) -> Floats:
    own, weight = _weights(normal, rings)
    mean = _iterated(normal, _NUM_MEANS, normal, rings, own, weight)
    once = _iterated(mean, _NARROW - _NUM_MEANS, normal, rings, own, weight)
    smooth = 2 * once - _iterated(once, _NARROW, normal, rings, own, weight)
    found = _blended(normal, smooth, _differences(smooth, normal, rings), tolerance)
    if wide_tolerance == 0:
        return found
    tilt = tilts(mean, rings, weight)
    fit_to_triangulation(mean, rings, own, weight)
    for coefficients in curved:
        smooth = _polynomial(normal - tilt, coefficients, rings, own, weight) + tilt
        detail = _differences(smooth, normal, rings)
        if np.exp(-((detail / wide_tolerance) ** 2)).mean() < _FEW:
            return found
        found = _blended(found, smooth, detail, wide_tolerance)
    own, weight = _weights(found, rings)
    smooth = _polynomial(found, flat, rings, own, weight)
    detail = _differences(smooth, normal, rings) + _CURVED * _variation(smooth, rings, weight)
    return _blended(found, smooth, detail, wide_tolerance)


@njit(cache=True, nogil=True)
def _iterated(start: Floats, num_times: int, normal: Floats, rings: FaceRings, own: Floats, weight: Floats) -> Floats:
    """Iterate the mean over each face and its ring; a mean of no length leaves the normal as it is."""
    smooth = start
    for _ in range(num_times):
        before, smooth = smooth, np.zeros_like(normal)
        _add_means(before, smooth, 1.0, rings, own, weight)
        _make_unit(smooth, normal)
    return smooth


@njit(cache=True, nogil=True)
def _differences(smooth: Floats, normal: Floats, rings: FaceRings) -> Floats:
    """Make the rows of ``smooth`` unit normals, and average their distances from ``normal`` over two rings."""
    _make_unit(smooth, normal)
    detail = np.zeros(len(normal))
    for f in range(len(normal)):
        detail[f] = np.sqrt(((smooth[f] - normal[f]) ** 2).sum())
    for _ in range(2):
        detail = _ring_means(detail, rings)
    return detail


@njit(cache=True, nogil=True)
def _variation(normal: Floats, rings: FaceRings, weight: Floats) -> Floats:
    """Weighted mean of the distances of each normal from those of its ring."""
    variation = np.zeros(len(normal))
    for f in range(len(normal)):
        for entry in range(rings.ptr[f], rings.ptr[f + 1]):
            variation[f] += weight[entry] * np.sqrt(square_distance(normal, f, rings.neighbor[entry]))
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
def _weights(normal: Floats, rings: FaceRings) -> tuple[Floats, Floats]:
    """Weights of each face and of each entry of its ring, which add up to 1."""
    area, ptr, neighbor = rings.area, rings.ptr, rings.neighbor
    num_faces = len(normal)
    reach, own, weight = np.empty(num_faces), np.ones(num_faces), np.empty(len(neighbor))
    for f in range(num_faces):
        differences = np.zeros(ptr[f + 1] - ptr[f] + 1)  # the first is that of the face to itself
        for entry in range(ptr[f], ptr[f + 1]):
            differences[entry - ptr[f] + 1] = np.sqrt(square_distance(normal, f, neighbor[entry]))
        reach[f] = min(max(_RANGE * np.median(differences), _LEAST), _MOST)
    for f in range(num_faces):
        for entry in range(ptr[f], ptr[f + 1]):
            g = neighbor[entry]
            weight[entry] = area[g] * np.exp(-square_distance(normal, f, g) / min(reach[f], reach[g]) ** 2)
        total = area[f] + weight[ptr[f] : ptr[f + 1]].sum()
        if total > 0:
            own[f] = area[f] / total
            weight[ptr[f] : ptr[f + 1]] /= total
    return own, weight


@njit(cache=True, nogil=True)
def _polynomial(normal: Floats, coefficients: Floats, rings: FaceRings, own: Floats, weight: Floats) -> Floats:
    """Sum of Chebyshev polynomials of the mean over each face and its ring."""
    last, this = normal.copy(), np.zeros_like(normal)
    _add_means(last, this, 1.0, rings, own, weight)
    total = coefficients[0] * last + coefficients[1] * this
    for coefficient in coefficients[2:]:
        for f in range(len(last)):
            for axis in range(3):
                last[f, axis] = -last[f, axis]
        _add_means(this, last, 2.0, rings, own, weight)  # T_k = 2 S T_(k-1) - T_(k-2)
        last, this = this, last
        if coefficient != 0:
            for f in range(len(this)):
                for axis in range(3):
                    total[f, axis] += coefficient * this[f, axis]
    return total


@njit(cache=True, nogil=True)
def _add_means(vector: Floats, out: Floats, factor: float, rings: FaceRings, own: Floats, weight: Floats) -> None:
    """Add multiples of the weighted means over each face and its ring to ``out``."""
    for f in range(len(vector)):
        x, y, z = own[f] * vector[f, 0], own[f] * vector[f, 1], own[f] * vector[f, 2]
        for entry in range(rings.ptr[f], rings.ptr[f + 1]):
            g, w = rings.neighbor[entry], weight[entry]
            x += w * vector[g, 0]
            y += w * vector[g, 1]
            z += w * vector[g, 2]
        out[f, 0] += factor * x
        out[f, 1] += factor * y
        out[f, 2] += factor * z


@njit(cache=True, nogil=True)
def _ring_means(value: Floats, rings: FaceRings) -> Floats:
    """Mean over each face and its ring, weighted by areas."""
    area, ptr, neighbor = rings.area, rings.ptr, rings.neighbor
    means = np.empty_like(value)
    for f in range(len(value)):
        total, weights = area[f] * value[f], area[f]
        for entry in range(ptr[f], ptr[f + 1]):
            g = neighbor[entry]
            total += area[g] * value[g]
            weights += area[g]
        means[f] = total / weights if weights > 0 else value[f]
    return means
