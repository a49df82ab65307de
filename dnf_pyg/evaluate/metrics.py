"""Error of a denoised mesh against the clean one: angles between facet normals, distances of vertices."""

import torch
from torch import Tensor
from torchmetrics import Metric

from dnf_pyg.mesh.geometry import angular_difference, mean_edge_length
from dnf_pyg.mesh.surface_distance import surface_distance

__all__ = ["MeanAngularDifference", "VertexError", "angular_difference", "mean_angular_difference", "normal_angles"]


def normal_angles(normal: Tensor, clean_normal: Tensor) -> Tensor:
    """Angles between the facet normals (F, 3) of two meshes, (F',), degrees, of the F' faces with a clean normal.

    Faces of zero area have none in the clean mesh.

    Raises:
        ValueError: If the two differ in shape.

    Example:
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
        >>> mean_angular_difference(torch.eye(3)[:2], torch.eye(3)[[0, 0]])
        45.0
    """
    return float(normal_angles(normal, clean_normal).double().mean())


class _Mean(Metric):
    """Mean of all values seen, NaN before the first; subclasses implement ``update`` and call ``_add``."""

    is_differentiable = False
    higher_is_better = False
    full_state_update = False
    total: Tensor
    count: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.add_state("total", torch.zeros((), dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("count", torch.zeros((), dtype=torch.long), dist_reduce_fx="sum")

    def _add(self, value: Tensor) -> None:
        self.total += value.double().sum()
        self.count += value.numel()

    def compute(self) -> Tensor:
        return (self.total / self.count).float()


class MeanAngularDifference(_Mean):
    r"""Mean angular difference :math:`\theta` in degrees between filtered and clean facet normals.

    Faces without a normal in the clean mesh (zero area) are left out. :func:`mean_angular_difference` is for one mesh.

    Source: Li et al. 2020, Sec. 4.

    Shapes:
        - **normal**, **clean_normal:** :math:`(F, 3)`
        - **output:** scalar, degrees; NaN before the first update

    Raises:
        ValueError: If the two differ in shape.

    Example:
        >>> metric = MeanAngularDifference()
        >>> metric(torch.eye(3)[:2], torch.eye(3)[[0, 0]])
        tensor(45.)
    """

    def update(self, normal: Tensor, clean_normal: Tensor) -> None:
        """Add the faces of one mesh or batch."""
        self._add(normal_angles(normal, clean_normal))


class VertexError(_Mean):
    r"""Mean distance :math:`E_v` of vertices to the clean surface, in multiples of the clean mesh's mean edge length.

    Shapes:
        - **pos:** :math:`(V, 3)`, **clean_pos:** :math:`(V', 3)`, model units; **clean_face:** :math:`(3, F)`
        - **output:** scalar, mean over all vertices seen

    Example:
        >>> pos = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        >>> metric = VertexError()
        >>> metric(pos + torch.tensor([0.0, 0.0, 0.5]), pos * 2, torch.tensor([[0], [1], [2]])).round(decimals=3)
        tensor(0.2200)
    """

    def update(self, pos: Tensor, clean_pos: Tensor, clean_face: Tensor) -> None:
        """Add the vertices of one mesh."""
        scale = float(mean_edge_length(clean_pos.double(), clean_face))
        self._add(surface_distance(pos, clean_pos, clean_face) / scale)
