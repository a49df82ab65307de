"""The graph whose nodes are the vertices of a mesh and whose links are its edges, as SciPy matrices."""

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array
from torch import Tensor

__all__ = ["lazy_walk", "vertex_adjacency"]


def vertex_adjacency(edge: Tensor, num_vertices: int) -> csr_array:
    """Mark the pairs of vertices that share an edge.

    Args:
        edge: Undirected edges, (2, U), see :func:`~dnf_pyg.mesh.edges`.
        num_vertices: Number of vertices V.

    Returns:
        Symmetric matrix (V, V) float64 with ones for edges; the row of a vertex without a face is empty.

    Example:
        >>> import torch
        >>> vertex_adjacency(torch.tensor([[0, 0, 1], [1, 2, 2]]), 4).toarray()
        array([[0., 1., 1., 0.],
               [1., 0., 1., 0.],
               [1., 1., 0., 0.],
               [0., 0., 0., 0.]])
    """
    start, end = edge.cpu().numpy()
    row, column = np.concatenate([start, end]), np.concatenate([end, start])
    return coo_array((np.ones(len(row)), (row, column)), shape=(num_vertices, num_vertices)).tocsr()


def lazy_walk(edge: Tensor, num_vertices: int) -> csr_array:
    r"""Average each vertex half with itself and half with the mean of its neighbours.

    .. math::
        \mathbf{S} = \tfrac{1}{2} (\mathbf{I} + \mathbf{D}^{-1} \mathbf{A})

    is the transition matrix of the lazy random walk on the graph with adjacency :math:`\mathbf{A}` and degrees
    :math:`\mathbf{D}`. Its eigenvalues lie in [0, 1], so each application smooths. After k steps the walk is Gaussian
    with a variance of k/4 squared edge lengths along each axis of the surface.

    Args:
        edge: Undirected edges, (2, U), see :func:`~dnf_pyg.mesh.edges`.
        num_vertices: Number of vertices V.

    Returns:
        Row-stochastic matrix (V, V) float64; a vertex without a face keeps its value.

    Example:
        >>> import torch
        >>> lazy_walk(torch.tensor([[0, 0, 1], [1, 2, 2]]), 4).toarray()
        array([[0.5 , 0.25, 0.25, 0.  ],
               [0.25, 0.5 , 0.25, 0.  ],
               [0.25, 0.25, 0.5 , 0.  ],
               [0.  , 0.  , 0.  , 1.  ]])
    """
    adjacency = vertex_adjacency(edge, num_vertices)
    degree = np.diff(adjacency.indptr)
    stay = np.where(degree > 0, 0.5, 1.0)
    return csr_array(diags_array(stay) + diags_array(0.5 / np.maximum(degree, 1)) @ adjacency)
