"""Smoothing of filtered facet normals where they vary no more than a filter errs."""

import math
from functools import cache

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import face_areas
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vectors import set_unit, square_distance

__all__ = ["smooth_normals"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]

_NARROW, _WIDE, _WIDEST = 8, 64, 1024  # iterations
_RIDGE = 1e-3
_STEEP = 0.3
_LARGEST = 3.0
_RANGE = 5.0  # in median differences of a face to those around it
_LEAST, _MOST = 0.05, 0.5  # limits of the range: 3 and 29 degrees
_DETAIL = 5.0  # in medians of what smoothing changes: more is detail, whatever the tolerance
_TINY = 1e-12  # tolerance where smoothing changes nothing, in place of 0
_FEW = 0.1  # share of a mesh that is smooth: with less, the wide filter is not worth its time
_CURVED = 2.0  # weight of differences from face to face: where a surface curves, a wide mean is off by about as much
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
    where = pos.detach().cpu().double()
    size = face_areas(where, topology.face)
    corner = where[topology.face.t()]  # (F, 3, 3)
    center = corner.mean(dim=1)
    found = _smoothed(
        normal.detach().cpu().double().contiguous().numpy(),
        (size / (size.max() or 1.0)).numpy(),
        (center.numpy(), corner.reshape(-1, 3).numpy()),
        ptr,
        ring,
        math.radians(tolerance),
        math.radians(wide_tolerance),
        _coefficients(_NARROW),
        _coefficients(_WIDE),
        _coefficients(_WIDEST),
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
    normal: Floats, area: Floats, place: tuple[Floats, Floats], ptr: Ints, ring: Shorts, tolerance: float,
    wide_tolerance: float, narrow: Floats, wide: Floats, widest: Floats,
) -> Floats:  # fmt: skip
    found, detail = _stage(normal, area, place, ptr, ring, narrow, tolerance, False)
    if wide_tolerance == 0 or np.exp(-((detail / wide_tolerance) ** 2)).mean() < _FEW:
        return found
    found, _ = _stage(found, area, place, ptr, ring, wide, wide_tolerance, False)
    return _stage(found, area, place, ptr, ring, widest, wide_tolerance, True)[0]


@njit(cache=True, nogil=True)
def _stage(
    normal: Floats, area: Floats, place: tuple[Floats, Floats], ptr: Ints, ring: Shorts, coefficients: Floats,
    tolerance: float, is_flat: bool,
) -> tuple[Floats, Floats]:  # fmt: skip
    own, weight = _weights(normal, area, ptr, ring)
    if is_flat:
        smooth = _polynomial(normal, coefficients, ptr, ring, own, weight)
    else:
        mean = normal
        for _ in range(2):
            before, mean = mean, np.zeros_like(normal)
            _add_means(before, mean, 1.0, ptr, ring, own, weight)
            _make_unit(mean, normal)
        tilt = _tilts(mean, place, ptr, ring, weight)
        _linearise(mean, place[0], ptr, ring, own, weight)
        smooth = _polynomial(normal - tilt, coefficients, ptr, ring, own, weight) + tilt
    detail = _differences(smooth, normal, area, ptr, ring)
    if is_flat:
        detail += _CURVED * _variation(smooth, ptr, ring, weight)
    return _blended(normal, smooth, detail, tolerance), detail


@njit(cache=True, nogil=True)
def _axes(normal: Floats, f: int) -> tuple[Floats, Floats]:
    """Two axes that are orthogonal to a normal and to each other."""
    x, y, z = normal[f, 0], normal[f, 1], normal[f, 2]
    # Duff et al. 2017
    sign = 1.0 if z >= 0 else -1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.array([1.0 + sign * x * x * a, sign * b, -sign * x]), np.array([b, sign + y * y * a, -y])


@njit(cache=True, nogil=True)
def _along(axis: Floats, vector: Floats, i: int, j: int) -> float:
    return (
        axis[0] * (vector[j, 0] - vector[i, 0])
        + axis[1] * (vector[j, 1] - vector[i, 1])
        + axis[2] * (vector[j, 2] - vector[i, 2])
    )


@njit(cache=True, nogil=True)
def _tilts(normal: Floats, place: tuple[Floats, Floats], ptr: Ints, ring: Shorts, weight: Floats) -> Floats:
    center, corner = place
    tilt = np.zeros_like(normal)
    for f in range(len(normal)):
        x, y = _axes(normal, f)
        uu = uv = vv = up = uq = vp = vq = 0.0
        for entry in range(ptr[f], ptr[f + 1]):
            g, w = ring[entry], weight[entry]
            u, v = _along(x, center, f, g), _along(y, center, f, g)
            p, q = _along(x, normal, f, g), _along(y, normal, f, g)
            uu += w * u * u
            uv += w * u * v
            vv += w * v * v
            up += w * u * p
            uq += w * (u * q + v * p)
            vq += w * v * q
        more = _RIDGE * (uu + vv)
        if more <= 0:
            continue
        uu, vv = uu + more, vv + more
        # least squares for the symmetric h of p = h11 u + h12 v, q = h12 u + h22 v
        h12 = (uq - uv * (up / uu + vq / vv)) / (uu + vv - uv * uv * (1 / uu + 1 / vv))
        h11, h22 = (up - uv * h12) / uu, (vq - uv * h12) / vv
        # gradient over the triangle of the quadratic function at its corners
        u0, v0 = _along(x, corner, 3 * f, 3 * f + 1), _along(y, corner, 3 * f, 3 * f + 1)
        u1, v1 = _along(x, corner, 3 * f, 3 * f + 2), _along(y, corner, 3 * f, 3 * f + 2)
        double_area = u0 * v1 - u1 * v0
        if double_area <= 0:
            continue
        # corners about the centroid: -(e0+e1)/3, e0 -..., e1 - ...
        mu, mv = (u0 + u1) / 3, (v0 + v1) / 3
        za = 0.5 * (h11 * mu * mu + 2 * h12 * mu * mv + h22 * mv * mv)
        zb = 0.5 * (h11 * (u0 - mu) ** 2 + 2 * h12 * (u0 - mu) * (v0 - mv) + h22 * (v0 - mv) ** 2) - za
        zc = 0.5 * (h11 * (u1 - mu) ** 2 + 2 * h12 * (u1 - mu) * (v1 - mv) + h22 * (v1 - mv) ** 2) - za
        gu, gv = (zb * v1 - zc * v0) / double_area, (zc * u0 - zb * u1) / double_area
        scale = min(1.0, _STEEP / max(np.hypot(gu, gv), 1e-12))
        for axis in range(3):
            tilt[f, axis] = scale * (gu * x[axis] + gv * y[axis])
    return tilt


@njit(cache=True, nogil=True)
def _linearise(normal: Floats, center: Floats, ptr: Ints, ring: Shorts, own: Floats, weight: Floats) -> None:
    for f in range(len(normal)):
        x, y = _axes(normal, f)
        uu = uv = vv = mu = mv = 0.0
        for entry in range(ptr[f], ptr[f + 1]):
            g, w = ring[entry], weight[entry]
            u, v = _along(x, center, f, g), _along(y, center, f, g)
            uu += w * u * u
            uv += w * u * v
            vv += w * v * v
            mu += w * u
            mv += w * v
        more = _RIDGE * (uu + vv)
        if more <= 0:
            continue
        uu, vv = uu + more, vv + more
        det = uu * vv - uv * uv
        gu, gv = (vv * mu - uv * mv) / det, (uu * mv - uv * mu) / det
        total = own[f]
        for entry in range(ptr[f], ptr[f + 1]):
            g = ring[entry]
            weight[entry] *= min(max(1 - gu * _along(x, center, f, g) - gv * _along(y, center, f, g), 0.0), _LARGEST)
            total += weight[entry]
        if total > 0:
            own[f] /= total
            weight[ptr[f] : ptr[f + 1]] /= total


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
