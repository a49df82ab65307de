"""Error of one denoised mesh against the clean one; :mod:`dnf_pyg.evaluate.metrics` accumulates it over meshes."""

from torch import Tensor

from dnf_pyg.mesh.geometry import angular_difference, mean_edge_length
from dnf_pyg.mesh.surface_distance import surface_distance

__all__ = ["mean_angular_difference", "normal_angles", "vertex_errors"]


def normal_angles(normal: Tensor, clean_normal: Tensor) -> Tensor:
    """Angles between the facet normals (F, 3) of two meshes, (F',), degrees, of the F' faces with a clean normal.

    Faces of zero area have none in the clean mesh.

    Raises:
        ValueError: If the two differ in shape.

    Example:
        >>> import torch
        >>> normal_angles(torch.eye(3), torch.tensor([[1.0, 0, 0], [1, 0, 0], [0, 0, 0]]))
        tensor([ 0., 90.])
    """
    if normal.shape != clean_normal.shape:
        raise ValueError(
            f"Expected 'clean_normal' of shape {list(normal.shape)} (got {list(clean_normal.shape)}). "
            "Pass the normals of the same faces."
        )
    known = clean_normal.any(dim=-1)
    return angular_difference(normal[known], clean_normal[known])


def mean_angular_difference(normal: Tensor, clean_normal: Tensor) -> float:
    r"""Mean angular difference :math:`\theta` of facet normals (F, 3), degrees, over the faces with a clean normal.

    Raises:
        ValueError: If the two differ in shape.

    Example:
        >>> import torch
        >>> mean_angular_difference(torch.eye(3)[:2], torch.eye(3)[[0, 0]])
        45.0
    """
    return float(normal_angles(normal, clean_normal).double().mean())


def vertex_errors(pos: Tensor, clean_pos: Tensor, clean_face: Tensor) -> Tensor:
    r"""Distances of vertices to the clean surface, (V,) float64, in multiples of the clean mesh's mean edge length.

    The mean over the vertices is :math:`E_v`.

    Args:
        pos: Vertex positions, (V, 3), model units.
        clean_pos: Vertex positions of the clean mesh, (V', 3), model units.
        clean_face: Its faces, (3, F).

    Example:
        >>> import torch
        >>> pos = torch.tensor([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
        >>> vertex_errors(pos + torch.tensor([0.0, 0.0, 0.5]), pos, torch.tensor([[0], [1], [2]])).mul(100).round()
        tensor([22., 22., 22.], dtype=torch.float64)
    """
    return surface_distance(pos, clean_pos, clean_face) / float(mean_edge_length(clean_pos.double(), clean_face))
