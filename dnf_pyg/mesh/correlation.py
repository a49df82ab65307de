"""How alike the values of a field are at vertices that lie a given number of edges apart."""

import numpy as np
from scipy.sparse import csr_array, eye_array
from torch import Tensor

from dnf_pyg.mesh.geometry import edges
from dnf_pyg.mesh.vertex_graph import vertex_adjacency

__all__ = ["correlation_by_ring"]


def correlation_by_ring(field: Tensor, face: Tensor, max_ring: int) -> list[float]:
    r"""Compute the autocorrelation of a scalar field over the mesh.

    .. math::
        \rho_n = \frac{\operatorname{mean}_{d(i, j) = n} (x_i - \bar{x})(x_j - \bar{x})}
        {\operatorname{mean}_i (x_i - \bar{x})^2}

    where d counts the edges of the shortest path between two vertices. Vertices without a face do not count. White
    noise has correlations near 0; those of an error that neighbouring vertices share decrease slowly with n.

    Args:
        field: Value of each vertex, (V,), for instance its displacement along the normal.
        face: Vertices of each face, (3, F).
        max_ring: Largest number of edges n. Memory grows with its square: about 130 numbers per vertex for 6.

    Returns:
        Correlations for n = 1 to ``max_ring``; nan where no vertices lie so far apart or where the field is constant.

    Raises:
        ValueError: If ``max_ring`` is below 1, or ``field`` does not have one value for each vertex.

    Example:
        >>> import torch
        >>> square = torch.tensor([[0, 0], [1, 2], [2, 3]])
        >>> correlation_by_ring(torch.tensor([1.0, -1.0, 1.0, -1.0]), square, 2)
        [-0.6, 1.0]
    """
    if max_ring < 1:
        raise ValueError(
            f"Expected 'max_ring' of at least 1 (got {max_ring}). Ring 1 holds the neighbours of a vertex."
        )
    if field.dim() != 1 or (face.numel() and field.numel() <= int(face.max())):
        raise ValueError(f"Expected 'field' with one value for each vertex (got shape {list(field.shape)}).")
    value = field.detach().cpu().double().numpy()
    adjacency = vertex_adjacency(edges(face), len(value))
    used = np.diff(adjacency.indptr) > 0
    value = np.where(used, value - value[used].mean(), 0.0) if used.any() else value
    variance = (value @ value) / max(used.sum(), 1)
    seen = ring = csr_array(eye_array(len(value), format="csr"))
    correlation = []
    for _ in range(max_ring):
        reached = ring @ adjacency
        reached.data[:] = 1.0
        ring = reached - reached.multiply(seen)
        ring.eliminate_zeros()
        seen = seen + ring
        scale = ring.nnz * variance
        correlation.append(float(value @ (ring @ value) / scale) if scale > 0 else float("nan"))
    return correlation
