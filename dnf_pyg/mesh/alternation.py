"""How much the finest detail of a mesh alternates from vertex to vertex, as noise does."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from dnf_pyg.mesh.vertex_graph import walk_means

__all__ = ["local_alternation", "neighbor_products", "noise_share"]

_STEPS = 40  # of the lazy walk: means over about 120 vertices

# Means over clean shapes are at most 0.68, over white noise that is stronger than the detail at least 0.9
_SHAPE, _NOISE = 0.6, 0.95


def local_alternation(walk: csr_array, detail: NDArray[np.float64], white: NDArray[np.float64]) -> NDArray[np.float64]:
    r"""Correlate the finest detail of the surface at the two ends of an edge, around each vertex.

    White noise bends neighbouring vertices in opposite directions. Sharp edges and the detail of a shape do so less,
    even on a statue that was decimated to a few thousand faces. With the lazy random walk S on the vertices and their
    positions and normals,

    .. math::
        b_i = \mathbf{n}_i \cdot \big( (\mathbf{I} - \mathbf{S})^2 \mathbf{x} \big)_i, \qquad
        a = \frac{\langle b_i b_j \rangle}{\langle b_i^2 + b_j^2 \rangle / 2}

    with means over the edges around a vertex. Values of b that are larger than typical around there are clipped before,
    so that sharp edges do not outweigh the noise beside them.

    Args:
        walk: Lazy random walk on the vertices, (V, V), see :func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`.
        detail: The values b, (V,).
        white: Columns of white noise after the same filter, (V, C).

    Returns:
        The correlations in relation to those of white noise, (V,): about 1 for white noise, 0.2 to 0.6 for clean
        shapes; 0 where the surface is flat.
    """
    values = np.column_stack([detail, white])
    typical = np.square(walk_means(walk, np.sqrt(np.abs(values)), _STEPS))  # about the median of the absolute values
    products, squares = neighbor_products(walk, np.clip(values, -typical, typical))
    reference = products[:, 1:].sum() / max(squares[:, 1:].sum(), 1e-300)
    mean = walk_means(walk, np.column_stack([products[:, 0], squares[:, 0]]), _STEPS)
    expected = reference * mean[:, 1]
    return np.divide(mean[:, 0], expected, out=np.zeros(len(detail)), where=expected != 0)


def neighbor_products(walk: csr_array, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum, over the edges at each vertex, the products of values (V, C) and the means of their squares."""
    degree = np.diff(walk.indptr)[:, None] - 1  # a row holds the vertex itself and its neighbours
    square = np.square(values)
    sums, sums_of_squares = (degree * (2 * (walk @ each) - each) for each in (values, square))
    return values * sums, (degree * square + sums_of_squares) / 2


def noise_share(alternation: ArrayLike, bent: ArrayLike) -> NDArray[np.float64]:
    """Tell which part of the finest detail is noise, as a ratio of standard deviations from 0 to 1.

    Args:
        alternation: Alternation of the detail, any shape.
        bent: From 1 where all pairs of adjacent faces are bent to 0 where the detail is that of sharp edges between
            flat sides, whose alternation says nothing of the noise; same shape. There the share is 1.

    Example:
        >>> noise_share([0.5, 0.6875, 1.0], 1.0).round(2).tolist(), noise_share(0.5, 0.0).tolist()
        ([0.0, 0.5, 1.0], 1.0)
    """
    noisy = np.clip((np.asarray(alternation) - _SHAPE) / (_NOISE - _SHAPE), 0, 1)
    return 1 - np.asarray(bent) * (1 - np.sqrt(noisy))
