"""How far a denoised mesh is from the clean one: angles of facet normals and distances of vertices."""

import torch
from torch import Tensor
from torchmetrics import Metric

from dnf_pyg.mesh.geometry import angular_difference, mean_edge_length
from dnf_pyg.mesh.surface_distance import surface_distance

__all__ = ["MeanAngularDifference", "VertexError", "angular_difference"]


class MeanAngularDifference(Metric):
    r"""Mean angular difference :math:`\theta` in degrees between filtered and clean facet normals.

    Faces without a normal in the clean mesh (zero area) are left out.

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

    is_differentiable = False
    higher_is_better = False
    full_state_update = False
    angle_sum: Tensor
    num_faces: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.add_state("angle_sum", torch.zeros((), dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("num_faces", torch.zeros((), dtype=torch.long), dist_reduce_fx="sum")

    def update(self, normal: Tensor, clean_normal: Tensor) -> None:
        """Add the faces of one mesh or batch."""
        if normal.shape != clean_normal.shape:
            raise ValueError(
                f"Expected 'normal' and 'clean_normal' of one shape "
                f"(got {list(normal.shape)}, {list(clean_normal.shape)})"
            )
        known = clean_normal.square().sum(dim=-1) > 0
        self.angle_sum += angular_difference(normal[known], clean_normal[known]).double().sum()
        self.num_faces += known.sum()

    def compute(self) -> Tensor:
        """Mean over all faces seen, in degrees."""
        return (self.angle_sum / self.num_faces).float()


class VertexError(Metric):
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

    is_differentiable = False
    higher_is_better = False
    full_state_update = False
    distance_sum: Tensor
    num_vertices: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.add_state("distance_sum", torch.zeros((), dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("num_vertices", torch.zeros((), dtype=torch.long), dist_reduce_fx="sum")

    def update(self, pos: Tensor, clean_pos: Tensor, clean_face: Tensor) -> None:
        """Add the vertices of one mesh."""
        scale = float(mean_edge_length(clean_pos.double(), clean_face))
        self.distance_sum += float(surface_distance(pos, clean_pos, clean_face).sum()) / scale
        self.num_vertices += len(pos)

    def compute(self) -> Tensor:
        """Mean over all vertices seen."""
        return (self.distance_sum / self.num_vertices).float()
