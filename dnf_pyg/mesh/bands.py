"""How strongly the vertices of a mesh respond to band-pass filters, in relation to white noise."""

from typing import NamedTuple

import numpy as np

from dnf_pyg.mesh.detail import Detail
from dnf_pyg.mesh.vertex_graph import walk_differences, walk_means

__all__ = ["Bands", "band_responses"]

_QUANTILE = 0.25  # of the vertices: larger responses may lie at sharp edges


class Bands(NamedTuple):
    r"""Responses of four bands, from fine to coarse, as multiples of those of white noise of unit variance.

    With the lazy random walk S on the vertices (:func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`), the bands are

    .. math::
        (\mathbf{I} - \mathbf{S})^4, \qquad \mathbf{S}^{12} (\mathbf{I} - \mathbf{S})^6, \qquad
        \mathbf{S}^{24} (\mathbf{I} - \mathbf{S})^6, \qquad \mathbf{S}^{48} (\mathbf{I} - \mathbf{S})^6.

    Attributes:
        high: Response of the finest band, in the unit of the positions.
        middle: Response of the next one.
        broad: Response of the one after it.
        low: Response of the coarsest band.
    """

    high: float
    middle: float
    broad: float
    low: float


def band_responses(detail: Detail) -> Bands:
    """Filter the positions of the vertices, and measure the results along the normals at the vertices with a face."""
    used, normal = detail.used, detail.normal[detail.used]
    signal = detail.differences(4)
    found = []
    for differences, means in ((0, 0), (2, 12), (0, 12), (0, 24)):
        signal = walk_means(detail.walk, walk_differences(detail.walk, signal, differences), means)
        along = np.abs((signal[used, :3] * normal).sum(axis=1))
        scale = np.quantile(np.abs(signal[used, 3:]), _QUANTILE)
        found.append(float(np.quantile(along, _QUANTILE) / scale) if scale > 0 else 0.0)
    return Bands(*found)
