"""Head that reads unit normals off features."""

import torch
from torch import Tensor
from torch.nn import functional as F
from torch_geometric.nn import MLP

__all__ = ["NormalHead"]


class NormalHead(MLP):
    """Regress a unit normal from the features of each face.

    The MLP runs in full precision under autocast: neighbouring directions in bf16 are a quarter of a degree apart.
    Source: Li et al. 2020, Sec. 3.3.2 and Fig. 3.

    Args:
        in_channels: Features per face.

    Shapes:
        - **x:** :math:`(F, C)`
        - **output:** :math:`(F, 3)`, unit length

    Example:
        >>> NormalHead(8).eval()(torch.randn(5, 8)).norm(dim=1).round().detach()
        tensor([1., 1., 1., 1., 1.])
    """

    def __init__(self, in_channels: int) -> None:
        sizes = [in_channels, in_channels, in_channels // 2, 3]
        super().__init__(sizes, norm_kwargs={"allow_single_element": True})

    def forward(self, x: Tensor) -> Tensor:
        """Regress the normals."""
        with torch.autocast(x.device.type, enabled=False):
            return F.normalize(super().forward(x.to(self.lins[0].weight.dtype)), dim=-1)
