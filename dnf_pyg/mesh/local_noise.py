"""Noise around each vertex of a mesh, and how much of a change of the facet normals it explains."""

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from torch import Tensor

from dnf_pyg.mesh.alternation import neighbor_products, noise_share
from dnf_pyg.mesh.concentration import concentration
from dnf_pyg.mesh.detail import Detail
from dnf_pyg.mesh.geometry import angular_difference, edge_lengths, face_areas, face_normals
from dnf_pyg.mesh.noise_level import NoiseEstimate, estimate_from_detail
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_graph import walk_means

__all__ = ["LocalNoise"]

_STEPS = 20  # of the lazy walk: means over about 60 vertices
_UNSEEN = 2.5  # ratio of correlated noise to its estimate, which misses the part of long range
_WEAKEST = 0.01  # noise that can be told from the shape, relative to the shortest edge at a vertex
_AMID_NONE = 0.08  # the same where the mesh as a whole has no noise: its finest detail reads as some
_FEW = 32  # vertices of a piece of which nothing can be told
_WITHIN = 2.5  # standard deviations up to which the deviation of a pair counts as noise, not as an edge
_BEYOND = 10.0  # ratio of an angle to that of the noise from which it makes no difference how large it is
_ROUNDS = 3
_ALTERNATING = -0.1  # correlation of the curvatures of neighbours: 0.1 to 0.4 at edges, -0.3 for noise
_EDGES, _RELIEF = 0.5, 0.75  # ratio of the readings of pairs and of the filter beside sharp edges, and on relief
_STEPPED = 0.23  # level above which only stairs of voxels alternate so
_CAUTION = 1.5  # power of the share of noise in the detail: 1 leaves more harm on statues, 2 more noise on parts
_FEWEST = 0.02  # share of the vertices around with which a reading counts

_BLURRED = 0.9  # ratio of concentrations: that of a sphere of 320 faces may fall to 0.94, stairs with noise reach 0.88
_KNOWN = 0.02  # radians up to which filtered normals are known

_MEAN = 0.7979  # of half-normal values, relative to the standard deviation
_ROOT = 0.8221  # mean of their square roots
_CUT = 0.9546  # root mean square of those within 2.5
_ANGLE = 0.8862  # mean angle between a noisy and the clean normal, relative to the root mean square


class LocalNoise:
    r"""Standard deviation of the noise around each vertex.

    Two readings are made around each vertex, and the smaller one counts, since each of them also takes something else
    for noise. The high-pass filter of :func:`~dnf_pyg.mesh.noise_level.estimate_noise` suppresses smooth shapes, but
    responds to sharp edges. The deviations of pairs of adjacent faces from a plane respond to curvature; but where
    part of the pairs are flat, those at edges stand out and are left out.

    Relief whose waves are only a few edges long fools both readings. There the part of it that is noise follows from
    its alternation (:mod:`dnf_pyg.mesh.alternation`), around the vertex or on the whole mesh, whichever is larger. Its
    power of 1.5 counts, which is cautious: where detail is as strong as noise, filtering removes both.

    Two kinds of noise leave or make flat pairs too. Impulsive noise spares many vertices: where neighbours are bent
    in opposite directions, as noise bends them and edges do not, and around there, the high-pass filter counts. For
    correlated noise, which bends pairs less, a multiple of the level of the whole mesh counts if it is larger.

    Noise displaces the vertices of a face independently, so it turns the normal of a face with heights h by about

    .. math::
        \tan t = s + s^3, \qquad s^2 = \sum_i \sigma_i^2 / h_i^2.

    The cube stands for strong noise, which also displaces vertices along the surface and reads weaker than it is.
    A filter that removes noise turns normals back by as much. One that flattens an edge or bends a plane turns them
    further, whatever the shape of the faces.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        topology: Connectivity of the mesh; computed if not given.

    Attributes:
        estimate: Level and correlation of the whole mesh.
        sigma: Standard deviation around each vertex, (V,) float64, model units; 0 for a mesh without noise.
        certain: Whether the noise there is strong enough to be told from the shape, (V,) bool. Below 0.01 of the
            shortest edge it is not, or below 0.08 of it where the mesh as a whole reads as clean. The fewer vertices a
            piece of the mesh has, the stronger the noise has to be; none is certain with fewer than 32.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> noise = LocalNoise(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        >>> noise.sigma.tolist(), noise.certain.any().item()
        ([0.0, 0.0, 0.0, 0.0], False)
    """

    estimate: NoiseEstimate
    sigma: Tensor
    certain: Tensor

    def __init__(self, pos: Tensor, face: Tensor, topology: Topology | None = None) -> None:
        detail = Detail(pos, face, topology)
        self._pos, self._face = torch.from_numpy(detail.unit * detail.pos), torch.from_numpy(detail.face)
        self._walk = detail.walk
        self.estimate = estimate_from_detail(detail)
        sigma = seen = np.zeros(len(pos))
        if self.estimate.level > 0:
            sharp, bent = self._high_pass(detail), self._bending(detail)
            flat = (_quotient(bent, sharp) - _EDGES) / (_RELIEF - _EDGES)
            share = np.maximum(noise_share(detail.alternation, np.clip(flat, 0, 1)), self.estimate.share)
            bent = np.maximum(bent, self._alternating(detail, sharp))
            correlated = self.estimate.is_correlated  # such noise bends pairs of faces less than it displaces them
            seen = sharp if correlated else share**_CAUTION * np.minimum(sharp, bent)
            level = _UNSEEN * self.estimate.level
            sigma = np.maximum(np.minimum(sharp, bent), level) if correlated else seen
        self.sigma = detail.unit * torch.from_numpy(sigma)
        self._shortest = torch.full_like(self.sigma, torch.inf)
        length = edge_lengths(self._pos, detail.edge)
        for end in detail.edge:
            self._shortest.scatter_reduce_(0, end, length, "amin")
        self.certain = self._certain(detail.unit * torch.from_numpy(seen))

    def unexplained(self, normal: Tensor, max_excess: float) -> Tensor:
        """Mark the vertices, (V,) bool, whose :meth:`excess` for filtered normals (F, 3) is above a limit.

        They are all marked if the normals of the others would be less concentrated
        (:func:`~dnf_pyg.mesh.concentration.concentration`) than those of the mesh, which no removal of noise leads to.
        """
        stays = self.excess(normal) > max_excess
        own = face_normals(self._pos, self._face)
        result = torch.where(stays[self._face].all(dim=0)[:, None], own, normal.to(own))
        return stays | (concentration(result) < _BLURRED * concentration(own))

    def excess(self, normal: Tensor) -> Tensor:
        """Relate the angles between facet normals and filtered ones to those that the noise explains.

        Args:
            normal: Filtered normals, (F, 3), unit length.

        Returns:
            Mean ratio around each vertex, (V,) float64: about 1 where noise was removed, up to 11 where more was
            changed; infinite where the noise is not certain.
        """
        angle = angular_difference(normal, face_normals(self._pos, self._face)).double()
        ratio = (angle / self.tilt()).clamp(max=_BEYOND)
        total = torch.zeros(len(self._pos), 2, dtype=torch.float64)
        for corner in self._face:
            total.index_add_(0, corner, torch.stack([ratio, torch.ones_like(ratio)], dim=1))
        mean = self._around(total.numpy())
        found = torch.from_numpy(_quotient(mean[:, 0], mean[:, 1])) / _ANGLE
        return torch.where(self.certain, found, torch.inf)

    def trust(self) -> Tensor:
        r"""Weights of the planes that filtered normals give the faces, (F,) float64, from 0 to 1.

        A plane turned about the centroid of its face by an error of 0.02 radians is off by as much as the noise where
        a corner is far away. So at the ends of a long triangle the noisy vertex is known better than the plane, and
        that counts less by the ratio of the variances:

        .. math::
            w = \min\Big(1, \frac{\sigma^2}{0.02^2 \, r^2}\Big)

        with the noise :math:`\sigma` at the corners and their distance :math:`r` from the centroid, root mean squares.
        """
        corner = self._pos[self._face]
        reach = (corner - corner.mean(dim=0)).square().sum(dim=-1).mean(dim=0).sqrt()
        sigma = self.sigma[self._face].square().mean(dim=0).sqrt()
        return (sigma / (_KNOWN * reach).clamp(min=1e-300)).clamp(max=1).square()

    def tilt(self) -> Tensor:
        """Angles by which the noise turns the facet normals, (F,) float64, degrees; root mean squares."""
        area = face_areas(self._pos, self._face)
        square = torch.zeros_like(area)
        for corner, left, right in zip(self._face, self._face.roll(-1, 0), self._face.roll(-2, 0), strict=True):
            opposite = (self._pos[left] - self._pos[right]).norm(dim=-1)
            height = 2 * area / opposite.clamp(min=1e-300)
            square += (self.sigma[corner] / height.clamp(min=1e-300)).square()
        tangent = square.sqrt()
        return torch.rad2deg(torch.atan(tangent + tangent**3)).clamp(min=1e-12)

    def _around(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Means of values (V, C) around each vertex."""
        return walk_means(self._walk, values, _STEPS)

    def _high_pass(self, detail: Detail) -> NDArray[np.float64]:
        """Reading of the high-pass filter, (V,), mean edge lengths."""
        along = np.abs(detail.along(4))
        white = _MEAN * np.sqrt(np.square(detail.white(4)).mean(axis=1))
        mean = self._around(np.stack([along, white], axis=1))
        return _quotient(mean[:, 0], mean[:, 1])

    def _bending(self, detail: Detail) -> NDArray[np.float64]:
        """Reading of the flat ones among the pairs of adjacent faces, (V,), mean edge lengths; infinite without any."""
        face, (deviation, pair) = detail.face, detail.pairs
        if not len(deviation):
            return np.full(len(self._pos), np.inf)
        corner = face[:, pair].reshape(6, -1).T
        spread = csr_array(
            (np.ones(corner.size), corner.ravel(), np.arange(0, corner.size + 1, 6)), (len(corner), len(self._pos))
        )
        mean = self._around(spread.T @ np.stack([np.sqrt(deviation), np.ones(len(deviation))], axis=1))
        near = mean[:, 1] > 1e-9
        found = np.square(_quotient(mean[:, 0], mean[:, 1]) / _ROOT)
        found *= _flat_share(_quotient(deviation, spread @ found / 6))
        for _ in range(_ROUNDS):
            flat = deviation <= _WITHIN * (spread @ found) / 6
            mean = self._around(spread.T @ np.stack([flat * np.square(deviation), flat], axis=1))
            found = np.where(mean[:, 1] > 1e-9, np.sqrt(_quotient(mean[:, 0], mean[:, 1])) / _CUT, found)
        return np.where(near, found, np.inf)

    def _alternating(self, detail: Detail, found: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean of a reading (V,) over the vertices around that are bent against their neighbours, or 0."""
        sums = neighbor_products(detail.walk, detail.along(1)[:, None])
        product, square = self._around(np.concatenate(sums, axis=1)).T
        noisy = (product < _ALTERNATING * square) & (found < _STEPPED)
        share, mean = self._around(np.stack([noisy, noisy * found], axis=1)).T
        return np.where(share >= _FEWEST, _quotient(mean, share), 0.0)

    def _certain(self, sigma: Tensor) -> Tensor:
        ratio = (sigma / self._shortest.clamp(min=1e-300)).clamp(max=1.0).numpy()
        piece = connected_components(self._walk, directed=False)[1]
        size = np.bincount(piece)[piece]
        weakest = _AMID_NONE if self.estimate.is_negligible else _WEAKEST
        needed = np.maximum((_FEW / size) ** 2, weakest)
        return torch.from_numpy(self._around(ratio[:, None])[:, 0] >= needed)


def _flat_share(value: NDArray[np.float64]) -> float:
    """Standard deviation of the half-normal values in a mixture with larger ones, at most 1."""
    quarter, half = np.quantile(value, [0.25, 0.5], method="lower")
    found = quarter / 0.3186 if quarter > 0 else half / 0.6745  # rounded coordinates leave many pairs flat
    for _ in range(50):
        flat = value[value <= _WITHIN * found]
        smaller = float(np.sqrt(np.square(flat).mean())) / _CUT
        if smaller >= found:
            break
        found = smaller
    return min(float(found), 1.0)


def _quotient(value: NDArray[np.float64], by: NDArray[np.float64]) -> NDArray[np.float64]:
    return value / np.maximum(by, 1e-300)
