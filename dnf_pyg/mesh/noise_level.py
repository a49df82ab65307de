"""Estimate of the noise of a mesh from the mesh alone."""

import numpy as np
from scipy import sparse
from torch import Tensor

from dnf_pyg.mesh.geometry import edges, mean_edge_length, vertex_normals

__all__ = ["estimate_noise_level"]

_SMOOTHING = 1  # rounds of averaging the normals that the noise is measured along
_SHARE = 0.3  # of the vertices, counted from the smallest response: the others may lie at sharp edges
_QUANTILE_OF_NORMAL = 0.3853  # that share of standard normal variables is smaller than this in absolute value

# Noise lengthens edges and turns the normals that it is measured along: what is found for which true level (measured
# on a part, a sphere and an animal with noise along the normal, which differ by less than 3% from level 0.2 on)
_FOUND = (0.0, 0.05, 0.101, 0.192, 0.276, 0.347, 0.402, 0.489, 0.553)
_TRUE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)


def estimate_noise_level(pos: Tensor, face: Tensor) -> float:
    """Estimate the standard deviation of the noise along the normal, in mean edge lengths of the clean mesh.

    Each vertex is compared with its surroundings by the twice applied umbrella operator, whose response to noise is
    known from its weights and whose response to a smoothly curved surface is small. A low quantile over the vertices
    leaves sharp edges out.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).

    Returns:
        Noise level from 0 to 1; 0 for a mesh without edges. Within 10% of the truth from 0.1 on for noise along the
        normal, too low for strong noise in all directions; fine detail counts as noise.

    Examples:
        >>> import torch
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> estimate_noise_level(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        0.0
    """
    pos = (pos - pos.mean(dim=0)).detach().cpu().double()
    edge = edges(face.cpu()).numpy()
    unit = float(mean_edge_length(pos, face.cpu()))
    if edge.shape[1] == 0 or unit == 0:
        return 0.0
    links = np.concatenate([edge, edge[::-1]], axis=1)
    ones = np.ones(links.shape[1])
    adjacency = sparse.coo_array((ones, (links[0], links[1])), shape=(len(pos), len(pos))).tocsr()
    degree = np.bincount(links[0], minlength=len(pos))
    mean_of_neighbors = sparse.diags_array(1 / np.maximum(degree, 1)) @ adjacency
    normal = vertex_normals(pos, face.cpu()).numpy()
    for _ in range(_SMOOTHING):
        normal = normal + mean_of_neighbors @ normal
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    umbrella = sparse.eye_array(len(pos), format="csr") - mean_of_neighbors
    twice = umbrella @ umbrella
    response = np.sqrt(np.asarray(twice.multiply(twice).sum(axis=1)).ravel())
    residual = np.abs(((twice @ pos.numpy()) * normal).sum(axis=1))
    inside = degree > 0
    ratio = residual[inside] / np.maximum(response[inside], 1e-12)
    return float(np.interp(np.quantile(ratio, _SHARE) / _QUANTILE_OF_NORMAL / unit, _FOUND, _TRUE))
