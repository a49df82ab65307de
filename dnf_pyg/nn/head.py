"""Head that reads unit normals off features."""

import torch
from torch import Tensor
from torch.nn import functional as F
from torch_geometric.nn import MLP

__all__ = ["NormalHead"]


class NormalHead(MLP):
    r"""Regress a unit normal from the features of each face.

    With candidates, the MLP gives a vector and logits :math:`a` that weigh them:

    .. math::
        \mathbf{n} = \frac{\mathbf{v} + \sum_c \mathrm{softmax}(a)_c \mathbf{n}_c}
        {\lVert \mathbf{v} + \sum_c \mathrm{softmax}(a)_c \mathbf{n}_c \rVert}.

    The MLP runs in full precision under autocast: neighbouring directions in bf16 are a quarter of a degree apart.
    Source: Li et al. 2020, Sec. 3.3.2 and Fig. 3.
    Differs: the paper's head has no candidates.

    Args:
        in_channels: Features per face.
        num_candidates: Number of normals N of each face that the head may choose from.

    Shapes:
        - **x:** :math:`(F, C)`
        - **candidates:** :math:`(F, N, 3)`, unit length; ``None`` without candidates
        - **output:** :math:`(F, 3)`, unit length

    Example:
        >>> NormalHead(8).eval()(torch.randn(5, 8)).norm(dim=1).round().detach()
        tensor([1., 1., 1., 1., 1.])
    """

    def __init__(self, in_channels: int, num_candidates: int = 0) -> None:
        sizes = [in_channels, in_channels, in_channels // 2, 3 + num_candidates]
        super().__init__(sizes, norm_kwargs={"allow_single_element": True})
        self.num_candidates = num_candidates

    def forward(self, x: Tensor, candidates: Tensor | None = None) -> Tensor:
        """Regress the normals."""
        with torch.autocast(x.device.type, enabled=False):
            vector, logit = super().forward(x.to(self.lins[0].weight.dtype)).split([3, self.num_candidates], dim=-1)
            if candidates is not None:
                vector = vector + (logit.softmax(dim=-1).unsqueeze(-1) * candidates).sum(dim=1)
            return F.normalize(vector, dim=-1)
