"""Estimate of the noise of a mesh from the mesh alone."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from torch import Tensor

from dnf_pyg.mesh.geometry import edges, mean_edge_length, vertex_normals
from dnf_pyg.mesh.vertex_graph import lazy_walk

__all__ = ["NoiseEstimate", "estimate_noise", "estimate_noise_level"]

_QUANTILE = 0.25  # low, because larger responses may lie at sharp edges
_NORMAL_QUANTILE = 0.3186  # a quarter of the standard normal distribution is smaller in absolute value

# Noise lengthens edges and turns the normals that it is measured along: response found for each true level (means of
# white noise along the normal on generated shapes, see docs/pictures/noise_estimates.py)
_FOUND = (0.0, 0.05, 0.101, 0.192, 0.276, 0.347, 0.402, 0.489, 0.553)
_TRUE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)

_SHAPE = 2.4  # ratio of the two bands' squared responses up to which fine detail of the shape may explain the middle one
_MIDDLE = 0.17  # squared response of the middle band to correlated noise of unit variance (white noise: 1)
_RHO = 0.85  # correlation at one edge of the noise beyond the white part


class NoiseEstimate(NamedTuple):
    """Estimated noise of a mesh.

    Attributes:
        level: Standard deviation along the normal, mean edge lengths.
        correlation: Correlation of the noise of two vertices that share an edge; 0 for white noise.
    """

    level: float
    correlation: float


def estimate_noise(pos: Tensor, face: Tensor) -> NoiseEstimate:
    r"""Estimate the level and the correlation of the noise of a mesh.

    With the lazy random walk S on the vertices (:func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`), the vertex positions
    are filtered by two band-pass filters, and the results are projected on smoothed vertex normals:

    .. math::
        \mathbf{H} = (\mathbf{I} - \mathbf{S})^4, \qquad
        \mathbf{M} = \mathbf{S}^{12} (\mathbf{I} - \mathbf{S})^6.

    The high powers of I - S suppress smoothly curved surfaces, and a low quantile over the vertices leaves out sharp
    edges. Each response is divided by that of white noise of unit variance on the same mesh. White noise responds
    equally in both bands; noise with a correlation length of some edges responds more in the middle band. What the
    middle band has beyond 2.4 times the square of the high band counts as correlated noise: fine detail of a shape
    reaches twice the square.

    Pairs of adjacent faces that agree exactly have no noise: where the four vertices of a quarter of the pairs are
    flatter than the high band tells, as on a clean CAD model whose vertices all lie at sharp edges, the level is
    reduced in proportion.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).

    Returns:
        Level from 0 on, and correlation from 0 to 0.85; both 0 for a mesh without edges or without noise. For white
        noise along the normal, the level is within 10% of the truth from 0.1 on, and too low for strong noise in all
        directions or on few vertices. Errors longer than some 5 edges look like shape and are not seen, so the level
        of correlated noise is a lower bound.

    Example:
        >>> import torch
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> estimate_noise(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        NoiseEstimate(level=0.0, correlation=0.0)
    """
    pos, face = pos.detach().cpu().double(), face.cpu()
    unit = float(mean_edge_length(pos, face))
    if unit == 0:
        return NoiseEstimate(0.0, 0.0)
    used = np.unique(face.numpy())
    centred = (pos - pos[used].mean(dim=0)) / unit
    walk = lazy_walk(face, len(pos))
    normal = _smooth_normals(walk, vertex_normals(pos, face).numpy())
    high, middle = _responses(walk, centred.numpy(), normal, used)
    if high == 0:
        return NoiseEstimate(0.0, 0.0)
    flat = min(1.0, _flatness(centred.numpy(), face.numpy()) / high)
    white = high**2
    correlated = max(middle**2 - _SHAPE * white, 0.0) / _MIDDLE
    bias = float(np.interp(flat * high, _FOUND, _TRUE)) / (flat * high) if flat else 1.0
    level = bias * flat * (white + correlated) ** 0.5
    return NoiseEstimate(level, _RHO * correlated / (white + correlated) if level else 0.0)


def estimate_noise_level(pos: Tensor, face: Tensor) -> float:
    """Estimate the standard deviation of the noise along the normal: the level of :func:`estimate_noise`.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).

    Returns:
        Noise level, mean edge lengths; 0 for a mesh without edges.
    """
    return estimate_noise(pos, face).level


def _smooth_normals(walk: csr_array, normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average unit normals (V, 3) over the neighbours three times."""
    for _ in range(3):
        normal = walk @ normal
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return normal


def _responses(
    walk: csr_array, pos: NDArray[np.float64], normal: NDArray[np.float64], used: NDArray[np.int64]
) -> tuple[float, float]:
    """Responses of the high and the middle band along the normals, multiples of those of unit white noise."""
    noise = np.random.default_rng(0).standard_normal((len(pos), 1))
    signal = np.concatenate([pos, noise], axis=1)

    def response() -> float:
        along = np.abs((signal[used, :3] * normal[used]).sum(axis=1))
        scale = np.quantile(np.abs(signal[used, 3]), _QUANTILE)
        return float(np.quantile(along, _QUANTILE) / scale) if scale > 0 else 0.0

    for _ in range(4):
        signal = signal - walk @ signal
    high = response()
    for _ in range(2):
        signal = signal - walk @ signal
    for _ in range(12):
        signal = walk @ signal
    return high, response()


def _flatness(pos: NDArray[np.float64], face: NDArray[np.int64]) -> float:
    r"""Deviation of pairs of adjacent faces from a plane, in standard deviations of white noise.

    The lines through the shared edge and through the opposite vertices of a pair would meet in a plane. Their
    distance is linear in the four vertices, with weights that follow from the points where the lines are closest.
    """
    start, end = face.ravel(), np.roll(face, -1, axis=0).ravel()
    opposite = np.roll(face, -2, axis=0).ravel()
    code = np.minimum(start, end) * (int(face.max()) + 1) + np.maximum(start, end)
    order = np.argsort(code, kind="stable")
    _, first, count = np.unique(code[order], return_index=True, return_counts=True)
    one = order[first[count == 2]]
    two = order[first[count == 2] + 1]
    if not len(one):
        return np.inf
    a, b, c, d = pos[start[one]], pos[end[one]], pos[opposite[one]], pos[opposite[two]]
    across = np.cross(b - a, d - c)
    squared = np.maximum((across**2).sum(axis=1), 1e-300)
    distance = np.abs(((c - a) * across).sum(axis=1)) / np.sqrt(squared)
    along = (np.cross(c - a, d - c) * across).sum(axis=1) / squared  # where the lines are closest: a + along (b - a)
    between = (np.cross(c - a, b - a) * across).sum(axis=1) / squared  # and c + between (d - c)
    weight = np.sqrt((1 - along) ** 2 + along**2 + (1 - between) ** 2 + between**2)
    return float(np.quantile(distance / weight, _QUANTILE, method="lower") / _NORMAL_QUANTILE)
