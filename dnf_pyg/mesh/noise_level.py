"""Estimate of the noise of a mesh from the mesh alone."""

from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from torch import Tensor

from dnf_pyg.mesh.flatness import pair_deviations
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_graph import lazy_walk, smoothed_normals

__all__ = ["NoiseEstimate", "estimate_noise", "estimate_noise_level"]

_QUANTILE = 0.25  # of the vertices: larger responses may lie at sharp edges
_COARSE = 0.6  # response of the middle band, mean edge lengths, that only a shape has
_FEW = 2000  # vertices, too few to tell noise from shape by the bands alone

# Noise lengthens edges and turns the normals that it is measured along: responses of the high band to white noise of
# known levels, means over generated shapes and spheres
_FOUND = (0.0, 0.05, 0.101, 0.195, 0.278, 0.342, 0.404, 0.492, 0.58)
_TRUE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)

# Squared ratio of the responses of the middle and the high band that white noise reaches on coarse shapes: the part
# of the shape counts less the stronger the noise is; real scans with weak noise reach at least 3.5
_WHITE, _SHAPE, _MOST = 1.9, 0.018, 3.2
_WIDTH = 0.12  # of the transition from white to correlated noise
_LARGEST = 3.2  # ratio of the responses in noise, which has a white part: real scans reach 2.9, relief starts at 3.4
_STRONG = 0.06  # response of the high band to a white part that relief of a mesh with white noise may be read with
_RISE, _WIDE = 3.55, 1.1  # from there on, ratio of the low to the middle band, and low band, that only a shape has
_VARIANCE = 2.0  # of correlated noise, relative to the squared response of the middle band
_WEAK = 0.01  # level of noise that is as good as none, whose correlation means nothing
_CORRELATED = 0.5  # correlation above which noise is not white
_CORRELATION = 0.85  # at one edge, of noise without a white part


class NoiseEstimate(NamedTuple):
    """Estimated noise of a mesh.

    Attributes:
        level: Standard deviation along the normal, mean edge lengths.
        correlation: Correlation of the noise at the two ends of an edge, from 0 for white noise to 0.85.
    """

    level: float
    correlation: float

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

    With the lazy random walk S on the vertices (:func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`), the vertex positions
    are filtered by three band-pass filters, and the results are projected on smoothed vertex normals:

    .. math::
        \mathbf{H} = (\mathbf{I} - \mathbf{S})^4, \qquad
        \mathbf{M} = \mathbf{S}^{12} (\mathbf{I} - \mathbf{S})^6, \qquad
        \mathbf{L} = \mathbf{S}^{48} (\mathbf{I} - \mathbf{S})^6.

    The powers of I - S suppress smoothly curved surfaces, and a low quantile over the vertices leaves out sharp
    edges. Each response is divided by that of white noise of unit variance on the same mesh. White noise responds
    equally in both bands, noise with a correlation length of a few edges more in the middle one. Relief of a clean
    shape responds still more there: noise always has a white part, so a high band without one, or much weaker than
    the middle band, means that there is no correlated noise. White noise on relief looks like correlated noise in
    these two bands. The low band tells them apart, since relief grows with its width, and noise ends at its
    correlation length.

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
        NoiseEstimate(level=0.0, correlation=0.0)
    """
    pos, face = pos.detach().cpu().double(), face.cpu()
    topology = topology or Topology(face, len(pos))
    unit = float(topology.mean_edge_length(pos))
    if unit == 0:
        return NoiseEstimate(0.0, 0.0)
    used = np.unique(face.numpy())
    centred = ((pos - pos[used].mean(dim=0)) / unit).numpy()
    walk = lazy_walk(topology.edges, len(pos))
    high, middle, low = _responses(walk, centred, smoothed_normals(walk, pos, face), used)
    flatness = _flatness(centred, face.numpy(), _QUANTILE)
    coarse = (middle > _COARSE and flatness < high / 2) or len(used) < _FEW
    if not coarse:
        flatness = _flatness(centred, face.numpy(), 0.5)  # the rounded depths of a scan leave many pairs flat
    if high == 0 or flatness == 0:
        return NoiseEstimate(0.0, 0.0)
    flat = flatness / high
    explained = min(1.0, flat + flatness)  # strong noise bends the pairs less than it moves the vertices
    white = explained * high
    relief = high > _STRONG and (low > _RISE * middle or low > _WIDE)
    is_shape = coarse or relief or high < _WEAK or middle > _LARGEST * high
    limit = min(_WHITE + _SHAPE / high**2, _MOST)
    excess = 0.0 if is_shape else max((middle / high) ** 2 - limit, 0.0) / _WIDTH
    correlated = excess / (1 + excess)
    certain = correlated * min(max(4 * flat - 3, 0.0), 1.0)  # not where sharp edges raise both bands
    variance = (1 - certain) * white**2 + certain * _VARIANCE * middle**2
    bias = float(np.interp(white, _FOUND, _TRUE)) / white
    return NoiseEstimate(bias * variance**0.5, explained * correlated * _CORRELATION)


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


def _responses(
    walk: csr_array, pos: NDArray[np.float64], normal: NDArray[np.float64], used: NDArray[np.int64]
) -> list[float]:
    """Responses of the high, middle and low band along the normals, multiples of those of unit white noise."""
    noise = np.random.default_rng(0).standard_normal((len(pos), 1))
    signal = np.concatenate([pos, noise], axis=1)

    def response() -> float:
        along = np.abs((signal[used, :3] * normal[used]).sum(axis=1))
        scale = np.quantile(np.abs(signal[used, 3]), _QUANTILE)
        return float(np.quantile(along, _QUANTILE) / scale) if scale > 0 else 0.0

    found = []
    for differences, means in ((4, 0), (2, 12), (0, 36)):
        for _ in range(differences):
            signal = signal - walk @ signal
        for _ in range(means):
            signal = walk @ signal
        found.append(response())
    return found


def _flatness(pos: NDArray[np.float64], face: NDArray[np.int64], quantile: float) -> float:
    """Deviation of pairs of adjacent faces from a plane, as the standard deviation of white noise that explains it."""
    deviation = pair_deviations(pos, face).deviation
    if not len(deviation):
        return np.inf
    return float(np.quantile(deviation, quantile, method="lower") / NormalDist().inv_cdf((1 + quantile) / 2))
