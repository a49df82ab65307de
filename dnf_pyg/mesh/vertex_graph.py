"""The graph whose nodes are the vertices of a mesh and whose links are its edges, as SciPy matrices."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from torch import Tensor

from dnf_pyg.mesh.geometry import vertex_normals

__all__ = ["lazy_walk", "smoothed_normals", "vertex_adjacency", "walk_differences", "walk_means"]


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


def walk_means(walk: csr_array, values: NDArray[np.float64], num_steps: int) -> NDArray[np.float64]:
    """Replace values (V, ...) by their means around each vertex, as many times as ``num_steps``."""
    for _ in range(num_steps):
        values = walk @ values
    return values


def walk_differences(walk: csr_array, values: NDArray[np.float64], num_steps: int) -> NDArray[np.float64]:
    """Subtract from values (V, ...) their means around each vertex, as many times as ``num_steps``."""
    for _ in range(num_steps):
        values = values - walk @ values
    return values


def smoothed_normals(walk: csr_array, pos: Tensor, face: Tensor) -> NDArray[np.float64]:
    """Average the vertex normals over the neighbours three times.

    Args:
        walk: See :func:`lazy_walk`, (V, V).
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).

    Returns:
        Normals, (V, 3), unit length; zero where those of the neighbours cancel.

    Example:
        >>> import torch
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> smoothed_normals(lazy_walk(torch.tensor([[0, 0, 1], [1, 2, 2]]), 3), pos, face)[0].round(2)
        array([0.58, 0.58, 0.58])
    """
    normal = vertex_normals(pos.double(), face).numpy()
    for _ in range(3):
        normal = walk @ normal
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return normal
