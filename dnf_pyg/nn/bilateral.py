"""Joint bilateral filter of normals whose guidance is learned."""

import torch
from torch import Tensor
from torch.nn import Linear
from torch.nn import functional as F
from torch_geometric.nn import MessagePassing
from torch_geometric.typing import Adj

from dnf_pyg.nn.neighbors import sort_by_center

__all__ = ["JointBilateralConv"]


class JointBilateralConv(MessagePassing):
    r"""Average each normal repeatedly with those neighbours that belong to the same smooth part of the surface.

    .. math::
        \mathbf{n}^{t+1}_i = \frac{\mathbf{m}_i}{\Vert \mathbf{m}_i \Vert}, \quad
        \mathbf{m}_i = \sum_{j \in \mathcal{N}(i)} w_{ij} \mathbf{n}^t_j, \quad
        w_{ij} = a_j \exp \left( -\Vert \mathbf{n}^0_i - \mathbf{n}^0_j \Vert^2 / \sigma_i^2
                             -\Vert \mathbf{q}_i - \mathbf{q}_j \Vert^2 \right)

    with the tolerance :math:`\sigma_i` and the guidance :math:`\mathbf{q}_i` read from the features of face i, and the
    area :math:`a_j` of face j if given. The weights are computed once, so an iteration costs one sparse product.
    On flat parts, iterating averages over many faces, with an accuracy that a max over few neighbours cannot match; a
    small :math:`\sigma_i` leaves a face unchanged.
    Source: Zheng et al. 2011 (bilateral normal filtering).
    Differs: the weights are learned.

    Args:
        in_channels: Features per face.
        guidance_channels: Size of :math:`\mathbf{q}`.
        num_iterations: Number of iterations.

    Shapes:
        - **normal:** :math:`(F, 3)`, unit length
        - **x:** :math:`(F, C)`
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1), the face itself among them
        - **area:** :math:`(F, 1)`, any unit; equal areas if ``None``
        - **output:** :math:`(F, 3)`, unit length; the input for a face without neighbours

    Example:
        >>> conv = JointBilateralConv(8)
        >>> normal = torch.eye(3)
        >>> conv(normal, torch.zeros(3, 8), torch.tensor([[0, 1, 2], [0, 1, 2]])).equal(normal)
        True
    """

    def __init__(self, in_channels: int, guidance_channels: int = 16, num_iterations: int = 12) -> None:
        super().__init__(aggr="sum")
        self.in_channels = in_channels
        self.guidance_channels = guidance_channels
        self.num_iterations = num_iterations
        self.guidance = Linear(in_channels, guidance_channels)
        self.sharpness = Linear(in_channels, 1)
        self.reset_parameters()

    def reset_parameters(self) -> None:
        """Start as a bilateral filter of the normals alone, with a tolerance of 0.25 (14 degrees)."""
        super().reset_parameters()
        torch.nn.init.normal_(self.guidance.weight, std=1e-2)
        torch.nn.init.zeros_(self.guidance.bias)
        torch.nn.init.zeros_(self.sharpness.weight)
        torch.nn.init.constant_(self.sharpness.bias, 4.0)

    def forward(self, normal: Tensor, x: Tensor, edge_index: Adj, area: Tensor | None = None) -> Tensor:
        """Filter the normals; in full precision, since bf16 directions are a quarter of a degree apart."""
        with torch.autocast(normal.device.type, enabled=False):
            x = x.to(self.guidance.weight.dtype)
            edges = sort_by_center(edge_index, (normal.size(0), normal.size(0)))
            weight = self.edge_updater(edges, normal=normal, guidance=self.guidance(x), sharpness=self.sharpness(x))
            if area is not None:
                weight = weight * area[edges[0]]
            for _ in range(self.num_iterations):
                normal = F.normalize(self.propagate(edges, normal=normal, weight=weight), dim=-1)
        return normal

    def edge_update(
        self, normal_i: Tensor, normal_j: Tensor, guidance_i: Tensor, guidance_j: Tensor, sharpness_i: Tensor
    ) -> Tensor:
        """Weight of each edge, shape (E, 1); ``sharpness`` is the inverse of the tolerance."""
        across = (normal_i - normal_j).square().sum(dim=-1, keepdim=True) * sharpness_i.square()
        return torch.exp(-across - (guidance_i - guidance_j).square().sum(dim=-1, keepdim=True))

    def message(self, normal_j: Tensor, weight: Tensor) -> Tensor:
        """Weighted normal of the neighbour."""
        return weight * normal_j

    def __repr__(self) -> str:
        return f"{self.__class__.__name__}({self.in_channels}, num_iterations={self.num_iterations})"
