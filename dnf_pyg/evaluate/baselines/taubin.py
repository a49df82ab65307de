"""Taubin smoothing."""

from dataclasses import dataclass

import torch
import trimesh
from torch import Tensor

from dnf_pyg.evaluate.baselines.filtered import FilteredMesh
from dnf_pyg.mesh.geometry import filled_face_normals
from dnf_pyg.mesh.validate import validate_mesh
from dnf_pyg.mesh.vertex_update import update_vertices

__all__ = ["TaubinSmoothing"]


@dataclass(frozen=True)
class TaubinSmoothing:
    r"""Move vertices towards the mean of their neighbours and a little farther back, which preserves the volume.

    The filtered normals are those of the smoothed mesh; the noisy vertices are then moved to fit them, as with every
    other filter here. Defaults are MeshLab's: ten pairs of steps with 0.5 and 0.53.

    Source: Taubin, A Signal Processing Approach to Fair Surface Design, SIGGRAPH 1995; trimesh's implementation.

    Args:
        shrink: Step towards the mean, a fraction of the way.
        inflate: Step away from it, a little larger than ``shrink``.
        num_pairs: Pairs of these two steps.
        num_vertex_iterations: Iterations of the vertex update after them.

    Raises:
        MeshError: If the mesh has no faces, wrong vertex numbers, or coordinates that are not finite.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.2]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> TaubinSmoothing()(pos, face).normal.shape
        torch.Size([2, 3])
    """

    shrink: float = 0.5
    inflate: float = 0.53
    num_pairs: int = 10
    num_vertex_iterations: int = 20

    def __call__(self, pos: Tensor, face: Tensor) -> FilteredMesh:
        """Denoise vertex positions (V, 3) of a mesh with faces (3, F)."""
        validate_mesh(pos, face)
        mesh = trimesh.Trimesh(pos.double().numpy(), face.t().numpy(), process=False)
        trimesh.smoothing.filter_taubin(mesh, lamb=self.shrink, nu=self.inflate, iterations=2 * self.num_pairs)
        normal = filled_face_normals(torch.tensor(mesh.vertices, dtype=pos.dtype), face)
        return FilteredMesh(update_vertices(pos, face, normal, self.num_vertex_iterations), normal)
