"""L0 minimization of the bends at edges."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array
from scipy.sparse.linalg import cg
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.evaluate.baselines.filtered import FilteredMesh
from dnf_pyg.evaluate.baselines.hinges import hinges
from dnf_pyg.mesh import filled_face_normals, mean_edge_length, validate_mesh
from dnf_pyg.mesh.geometry import angular_difference

__all__ = ["L0Minimization", "edge_operator"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_REGULARITY = 0.1  # first weight of the regularizer, in mean dihedral angles; it halves in every iteration


@dataclass(frozen=True)
class L0Minimization:
    r"""Make as many edges as possible flat, and move the vertices as little as possible.

    .. math::
        \min_{\mathbf{p}} \; \Vert \mathbf{p} - \mathbf{p}^{\text{noisy}} \Vert^2
        + \alpha \Vert R \mathbf{p} \Vert^2 + \lambda \, \Vert D \mathbf{p} \Vert_0

    where :math:`D` (:func:`edge_operator`) is zero at a flat edge and :math:`R` keeps the two triangles at an edge
    from becoming slivers. With :math:`\lambda` = ``strength`` times the squared mean edge length times the mean
    dihedral angle in radians, an auxiliary vector :math:`\delta` takes the place of :math:`D \mathbf{p}` where
    :math:`\Vert D \mathbf{p} \Vert^2 \geq \lambda / \beta` and is zero elsewhere, and the positions minimize
    :math:`\beta \Vert D \mathbf{p} - \delta \Vert^2` in place of the last term, for a growing :math:`\beta`.
    Defaults are those of the public code of Zhang et al. 2015.

    Source: He, Schaefer, Mesh Denoising via L0 Minimization, SIGGRAPH 2013: area-based edge operator.
    Differs: conjugate gradients, started at the previous positions, solve the linear systems.

    Args:
        strength: Factor of :math:`\lambda`, no unit; larger makes more edges flat.
        growth: Factor of :math:`\beta` from one iteration to the next.
        first_weight: First :math:`\beta`.
        last_weight: Iterations end where :math:`\beta` reaches it.

    Raises:
        MeshError: If the mesh has no faces, wrong vertex numbers, or coordinates that are not finite, or if a linear
            system cannot be solved.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.2]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> first, second = L0Minimization()(pos, face).normal
        >>> bool((first - second).norm() < 1e-3)
        True
    """

    strength: float = 0.2
    growth: float = 1.414
    first_weight: float = 1e-3
    last_weight: float = 1e3

    def __call__(self, pos: Tensor, face: Tensor) -> FilteredMesh:
        """Denoise vertex positions (V, 3) of a mesh with faces (3, F)."""
        validate_mesh(pos, face)
        pair, vertex = hinges(face)
        if pair.size(1) == 0:
            return FilteredMesh(pos.clone(), filled_face_normals(pos, face))
        normal = filled_face_normals(pos.double(), face)
        bend = float(angular_difference(normal[pair[0]], normal[pair[1]]).deg2rad().mean())
        penalty = self.strength * bend * float(mean_edge_length(pos.double(), face)) ** 2
        center = pos.double().mean(dim=0)
        moved = self._solve((pos - center).double().numpy(), vertex.numpy(), penalty, bend)
        result = (torch.from_numpy(moved) + center).to(pos.dtype)
        return FilteredMesh(result, filled_face_normals(result, face))

    def _solve(self, noisy: Floats, vertex: Ints, penalty: float, bend: float) -> Floats:
        """Move the positions (V, 3), given the vertices around each edge, (4, E)."""
        shape = vertex.shape[1], len(noisy)
        place = np.tile(np.arange(shape[0]), 4), vertex.flatten()
        regularizer = csr_array((np.repeat([1.0, 1.0, -1.0, -1.0], shape[0]), place), shape=shape)
        regular = (regularizer.T @ regularizer).tocsr()
        moved, weight, regularity = noisy, self.first_weight, _REGULARITY * bend
        while weight < self.last_weight:
            operator = csr_array((edge_operator(moved, vertex).flatten(), place), shape=shape)
            sparse = np.asarray(operator @ moved)
            sparse[np.square(sparse).sum(axis=1) < penalty / weight] = 0
            system = (eye_array(len(noisy)) + regularity * regular + weight * (operator.T @ operator)).tocsr()
            target = noisy + weight * (operator.T @ sparse)
            scale = diags_array(1 / system.diagonal())
            columns = [cg(system, b, x0=x, M=scale) for b, x in zip(target.T, moved.T, strict=True)]
            if any(failed for _, failed in columns):
                raise MeshError("Expected L0 minimization to converge (got no solution). Leave this method out.")
            moved = np.stack([column for column, _ in columns], axis=1)
            weight *= self.growth
            regularity /= 2
        return moved


def edge_operator(pos: Floats, vertex: Ints) -> Floats:
    r"""Coefficients of the area-based edge operator.

    Applied to the four vertices around an edge they give :math:`h (\mathbf{u} + \mathbf{v})` with the unit vectors that
    lead from the edge into the two faces, at right angles to it, and :math:`1/h` the sum of the inverse heights of the
    two faces over the edge: zero for a flat edge.

    Args:
        pos: Vertex positions, (V, 3).
        vertex: Vertices around each edge, (4, E), as in :func:`~dnf_pyg.evaluate.baselines.hinges.hinges`.

    Returns:
        Coefficients, (4, E), in the order of ``vertex``; zero for an edge without length or with two faces without
        area.

    Example:
        >>> square = np.array([[0.0, 0, 0], [0, 2, 0], [1, 1, 0], [-1, 1, 0]])
        >>> edge_operator(square, np.arange(4)[:, None]).ravel()
        array([-0.5, -0.5,  0.5,  0.5])
    """
    start, end, *opposite = pos[vertex]  # (E, 3) each
    edge = end - start
    square = np.square(edge).sum(axis=1)
    foot = [((apex - start) * edge).sum(axis=1) / np.where(square > 0, square, 1) for apex in opposite]
    area = [np.linalg.norm(np.cross(edge, apex - start), axis=1) for apex in opposite]
    total = np.where(area[0] + area[1] > 0, area[0] + area[1], 1)
    share = [area[1] / total, area[0] / total]
    to_end = -share[0] * foot[0] - share[1] * foot[1]
    to_start = -share[0] - share[1] - to_end
    return np.stack([to_start, to_end, *share])
