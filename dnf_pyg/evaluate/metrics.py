"""Error of denoised meshes against the clean ones, accumulated over meshes or batches by torchmetrics."""

import torch
from torch import Tensor
from torchmetrics import Metric

from dnf_pyg.evaluate.measures import normal_angles, vertex_errors

__all__ = ["MeanAngularDifference", "VertexError"]


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

    Faces without a normal in the clean mesh (zero area) are left out. For one mesh, there is the function
    :func:`~dnf_pyg.evaluate.measures.mean_angular_difference`.

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
        self._add(vertex_errors(pos, clean_pos, clean_face))
