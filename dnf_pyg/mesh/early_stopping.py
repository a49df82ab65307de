"""Early stopping of the vertex update, at the smallest estimated error."""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array
from torch import Tensor

from dnf_pyg.mesh.vertex_graph import vertex_adjacency, walk_means

__all__ = ["EarlyStopping"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]

_SMOOTHINGS = 4  # of the rates over neighbours, which differ much from vertex to vertex
_TANGENTIAL_WEIGHT = 0.6  # of movements along the surface: at sharp edges they remove noise, but less surely
_MOST_TANGENTIAL = 1.6  # noise along the normals stays below 2, noise in all directions reaches 7 at sharp edges
_FEWEST = 3  # iterations: on meshes of a hundred vertices, the estimate of the error is uncertain
_PATIENCE = 10  # iterations: on a rippled sphere, the estimated error rises for five and then falls for eighty


class EarlyStopping:
    r"""Tell when the vertex update begins to raise the error of the mesh, without knowing the true surface.

    The first iterations of the update remove the noise of the vertices, later ones bend the surface to errors of the
    filtered normals. With fixed normals the update is linear: :math:`\mathbf{x}_{t+1} = \mathbf{M} \mathbf{x}_t`, where
    :math:`\mathbf{x}_0` is the true surface plus the noise :math:`\mathbf{\epsilon}`. After the displacement
    :math:`\mathbf{u} = \mathbf{x}_t - \mathbf{x}_0`, a step :math:`\mathbf{d}` changes the squared error by about twice

    .. math::
        \langle \mathbf{u} + \mathbf{\epsilon}, \mathbf{d} \rangle \approx
        \langle \mathbf{u}, \mathbf{d} \rangle +
        \mathrm{E} \langle \mathbf{\epsilon}, (\mathbf{M} - \mathbf{I}) \mathbf{M}^t \mathbf{\epsilon} \rangle .

    The first product is known. The second is that of white noise of the same strength, which goes through the same
    iterations. Products are taken of the differences along edges, since errors of the normals are what counts. Each
    vertex with its surroundings has such a rate. While the median rate is negative, half of the surface gains. The
    estimated error is the sum of the median rates, each divided by the mean size of the rates of its step, so that
    early and late steps count alike. The update should end where this sum is smallest; ten iterations without a smaller
    one end the search.

    Source: Stein, "Estimation of the Mean of a Multivariate Normal Distribution", 1981; Ramani et al., "Monte-Carlo
    SURE", 2008 (the random signs).
    Differs: the strength of the noise is that with which the first steps of mesh and noise are equally large along the
    normals. The median over the surface takes the place of the sum, so that a few wrong normals at an edge do not
    decide. Movements along the surface count less than those along the normals. Where the first step has more of them
    than noise along the normals explains, the mesh has noise in all directions, and they do not count.

    Args:
        step: One iteration of the update for any vectors at the vertices, (V, 3) to (V, 3).
        direction: Normals of the vertices, (V, 3), unit length; the noise lies along them.
        edge: Undirected edges, (2, U).
        free: Vertices that may move and have a face, (V,) bool.

    Attributes:
        best: Number of iterations with the smallest estimated error so far, three or more as soon as there are three.
    """

    def __init__(self, step: Callable[[Floats], Floats], direction: Floats, edge: Tensor, free: Flags) -> None:
        adjacency = vertex_adjacency(edge, len(direction))
        degree = np.diff(adjacency.indptr)
        self._walk = csr_array(diags_array(1 / (degree + 1.0)) @ (adjacency + eye_array(len(direction))))
        self._edge = np.ascontiguousarray(edge.t().cpu().numpy())
        self._step = step
        self._free = free
        self._direction = direction
        signs = np.random.default_rng(0).choice((-1.0, 1.0), len(direction))
        self._noise = self._left = np.where(free[:, None], signs[:, None] * direction, 0.0)
        self._variance, self._tangential_weight = 0.0, _TANGENTIAL_WEIGHT
        self.best, self._count, self._error, self._smallest = 0, 0, 0.0, 0.0

    def should_end(self, moved: Floats, step: Floats) -> bool:
        """Take note of a step, and tell whether no further one is likely to lower the estimated error.

        Args:
            moved: Displacements so far, (V, 3): the mean of those before and after the step.
            step: Displacements of this step, (V, 3).
        """
        self._count += 1
        self._error += self._relative_rate(moved, step)
        if self._error <= self._smallest or self._count <= _FEWEST:
            self.best, self._smallest = self._count, self._error
        return self._count >= self.best + _PATIENCE

    def _relative_rate(self, moved: Floats, step: Floats) -> float:
        left = self._step(self._left)
        noise_step, self._left = left - self._left, left
        if self._variance == 0.0:
            self._calibrate(step, noise_step)
        moved, step, noise_step = (
            _weighted(values, self._direction, self._tangential_weight) for values in (moved, step, noise_step)
        )
        rate = _rates(moved, step, self._noise, noise_step, self._variance, self._edge)
        rate = walk_means(self._walk, rate, _SMOOTHINGS)[self._free]
        size = np.abs(rate).mean() if len(rate) else 0.0
        return float(np.median(rate) / size) if size > 0 else 0.0

    def _calibrate(self, step: Floats, noise_step: Floats) -> None:
        """Set the variance of the noise from the first steps, and see whether the mesh has noise in all directions."""
        normal, noise_normal = (_weighted(values, self._direction, 0.0) for values in (step, noise_step))
        self._variance = _energy(normal, self._edge) / max(_energy(noise_normal, self._edge), 1e-300)
        explained = self._variance * _energy(noise_step - noise_normal, self._edge)
        if _energy(step - normal, self._edge) > _MOST_TANGENTIAL * explained:
            self._tangential_weight = 0.0


@njit(cache=True, nogil=True)
def _weighted(vector: Floats, direction: Floats, tangential_weight: float) -> Floats:
    """Multiply the parts of vectors, (V, 3), that are orthogonal to the directions, (V, 3), by a weight."""
    weighted = np.empty_like(vector)
    for v in range(len(vector)):
        along = 0.0
        for axis in range(3):
            along += vector[v, axis] * direction[v, axis]
        for axis in range(3):
            normal = along * direction[v, axis]
            weighted[v, axis] = normal + tangential_weight * (vector[v, axis] - normal)
    return weighted


@njit(cache=True, nogil=True)
def _energy(vector: Floats, edge: Ints) -> float:
    """Sum of the squared differences of vectors, (V, 3), along edges, (U, 2)."""
    energy = 0.0
    for e in range(len(edge)):
        for axis in range(3):
            energy += (vector[edge[e, 0], axis] - vector[edge[e, 1], axis]) ** 2
    return energy


@njit(cache=True, nogil=True)
def _rates(moved: Floats, step: Floats, noise: Floats, noise_step: Floats, variance: float, edge: Ints) -> Floats:
    """Rate of the error at each vertex, (V,): products of differences to its neighbours, of the mesh and of the noise.

    ``edge`` holds the two vertices of each edge, (U, 2).
    """
    rate = np.zeros(len(moved))
    for e in range(len(edge)):
        v, w = edge[e, 0], edge[e, 1]
        product = noise_product = 0.0
        for axis in range(3):
            product += (moved[v, axis] - moved[w, axis]) * (step[v, axis] - step[w, axis])
            noise_product += (noise[v, axis] - noise[w, axis]) * (noise_step[v, axis] - noise_step[w, axis])
        product += variance * noise_product
        rate[v] += product
        rate[w] += product
    return rate
