"""Estimate of the noise of a mesh from the mesh alone."""

from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from torch import Tensor

from dnf_pyg.mesh.alternation import noise_share
from dnf_pyg.mesh.bands import Bands, band_responses
from dnf_pyg.mesh.detail import Detail
from dnf_pyg.mesh.topology import Topology

__all__ = ["NoiseEstimate", "estimate_from_detail", "estimate_noise", "estimate_noise_level"]

_QUANTILE = 0.25  # of the pairs of faces: larger deviations may lie at sharp edges
_COARSE = 0.6  # response of the middle band, mean edge lengths, that only a shape has
_FEW = 2000  # vertices, too few to tell noise from shape by the bands alone

# Noise lengthens edges and turns the normals that it is measured along: responses of the high band to white noise of
# known levels, means over generated shapes and spheres
_FOUND = (0.0, 0.05, 0.101, 0.195, 0.278, 0.342, 0.404, 0.492, 0.58)
_TRUE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)


# Squared ratio of the responses of the middle and the high band that white noise reaches on coarse shapes: the part
# of the shape counts less the stronger the noise is; real scans with weak noise reach at least 3.5
_WHITE, _SHAPE, _MOST = 1.9, 0.018, 3.2
_EDGES, _RELIEF = 0.85, 1.0  # ratio of what pairs of faces and the high band tell on CAD models, and on relief
_LEAST = 0.01  # share of noise in the detail of a clean shape: a part of the mesh may still be noisy
_WIDTH = 0.12  # of the transition from white to correlated noise

# Noise ends at its correlation length, where relief rises on with the width of the band
_LARGEST = 3.2  # ratio of the responses in noise, which has a white part: real scans reach 2.9, relief starts at 3.4
_ALTERNATION = 0.65  # of real scans at least: 0.68
_RISE = 2.7  # ratio of the low to the middle response of relief; of scans, too, with weak noise and less relief:
_WIDE, _CONVEX = 0.4, 0.9  # their low response, and high times broad over the square of the middle one, stay below
_VARIANCE = 2.0  # of correlated noise, relative to the squared response of the middle band
_WEAK = 0.01  # level of noise that is as good as none, whose correlation means nothing
_CORRELATED = 0.5  # correlation above which noise is not white
_CORRELATION = 0.85  # at one edge, of noise without a white part


class NoiseEstimate(NamedTuple):
    """Estimated noise of a mesh.

    Attributes:
        level: Standard deviation along the normal, mean edge lengths.
        correlation: Correlation of the noise at the two ends of an edge, from 0 for white noise to 0.85.
        share: Part of the finest detail of the mesh that is noise, from 0 to 1: a ratio of standard deviations.
    """

    level: float
    correlation: float
    share: float = 1.0

    @property
    def is_correlated(self) -> bool:
        """Whether the noise is that of a scan rather than white noise."""
        return not self.is_negligible and self.correlation > _CORRELATED

    @property
    def is_negligible(self) -> bool:
        """Whether the level is so low that the mesh counts as clean."""
        return self.level < _WEAK


def estimate_noise(pos: Tensor, face: Tensor, topology: Topology | None = None) -> NoiseEstimate:
    r"""Estimate the level and the correlation of the noise of a mesh.

    The vertex positions are filtered by four bands (:class:`~dnf_pyg.mesh.bands.Bands`). The finest one suppresses
    smoothly curved surfaces, and a low quantile over the vertices leaves out sharp edges, so its response is the level.

    What remains of the shape is told from noise by the signs: white noise bends neighbouring vertices in opposite
    directions, and detail of a shape does so less, even on a statue that was decimated to a few thousand faces. So
    the level is that part of the response which alternates as noise does.

    White noise responds equally in all bands, and noise with a correlation length of a few edges more in the second.
    White noise on relief does so, too, but relief keeps growing with the width of the band.

    Pairs of adjacent faces tell noise from sharp edges: on a clean CAD model whose vertices all lie at sharp edges,
    many pairs are exactly flat, while noise bends all of them. Where the pairs are flatter than the high band
    suggests, the estimate is reduced in proportion.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        topology: Connectivity of the mesh; computed if not given.

    Returns:
        Level and correlation; both 0 for a mesh without edges or without noise. The level is within 10% of the truth
        from 0.1 on for white noise along the normal. It is too low for strong noise in all directions, and for
        correlated noise, whose part longer than about 5 edges cannot be told from the shape. A correlation above 0.5
        means correlated noise, or a level below 0.1 on a shape with edges or detail only a few mean edges apart. It
        is 0 where less than about a twentieth of the variance is white, as such noise cannot be told from relief, and
        for meshes of fewer than 2,000 vertices.

    Example:
        >>> import torch
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> estimate_noise(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        NoiseEstimate(level=0.0, correlation=0.0, share=0.0)
    """
    return estimate_from_detail(Detail(pos, face, topology))


def estimate_from_detail(detail: Detail) -> NoiseEstimate:
    """Estimate the noise of a mesh as :func:`estimate_noise` does, from detail that is computed already."""
    if not len(detail.used):
        return NoiseEstimate(0.0, 0.0, 0.0)
    bands = band_responses(detail)
    high, middle = bands.high, bands.middle
    flatness = _flatness(detail, _QUANTILE)
    coarse = (middle > _COARSE and flatness < high / 2) or len(detail.used) < _FEW
    is_rounded = False
    if not coarse:  # the rounded depths of a scan leave many pairs flat
        quarter, flatness = flatness, _flatness(detail, 0.5)
        is_rounded = quarter < flatness / 2
    if high == 0 or flatness == 0:
        return NoiseEstimate(0.0, 0.0, 0.0)
    flat = flatness / high
    alternation = float(detail.alternation[detail.used].mean())
    bent = min(max((flat - _EDGES) / (_RELIEF - _EDGES), 0.0), 1.0)
    limit = min(_WHITE + _SHAPE / high**2, _MOST)
    is_shape = coarse or _is_shape(bands, alternation, is_rounded)
    excess = 0.0 if is_shape else max((middle / high) ** 2 - limit, 0.0) / _WIDTH
    correlated = excess / (1 + excess)
    share = correlated + (1 - correlated) * max(float(noise_share(alternation, bent)), _LEAST)
    explained = min(1.0, flat + flatness)  # strong noise bends the pairs less than it moves the vertices
    white = share * explained * high
    certain = correlated * min(max(4 * flat - 3, 0.0), 1.0)  # not where sharp edges raise both bands
    variance = (1 - certain) * white**2 + certain * _VARIANCE * middle**2
    bias = float(np.interp(white, _FOUND, _TRUE)) / white
    return NoiseEstimate(bias * variance**0.5, explained * correlated * _CORRELATION, share)


def estimate_noise_level(pos: Tensor, face: Tensor, topology: Topology | None = None) -> float:
    """Estimate the standard deviation of the noise along the normal: the level of :func:`estimate_noise`.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        topology: Connectivity of the mesh; computed if not given.

    Returns:
        Noise level, mean edge lengths; 0 for a mesh without edges.
    """
    return estimate_noise(pos, face, topology).level


def _is_shape(bands: Bands, alternation: float, is_rounded: bool) -> bool:
    """Whether bands that look like correlated noise are those of relief, with white noise or without."""
    high, middle, broad, low = bands
    return (
        high < _WEAK
        or middle > _LARGEST * high
        or alternation < _ALTERNATION
        or (low > _RISE * middle and ((low > _WIDE and not is_rounded) or high * broad > _CONVEX * middle**2))
    )


def _flatness(detail: Detail, quantile: float) -> float:
    """Deviation of pairs of adjacent faces from a plane, as the standard deviation of white noise that explains it."""
    deviation = detail.pairs.deviation
    if not len(deviation):
        return np.inf
    return float(np.quantile(deviation, quantile, method="lower") / NormalDist().inv_cdf((1 + quantile) / 2))
