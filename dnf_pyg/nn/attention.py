"""Channel attention over the faces of a patch."""

import torch
from torch import Tensor
from torch.nn import BatchNorm1d, Linear, Module
from torch.nn import functional as F
from torch_geometric.index import index2ptr

from dnf_pyg.nn.kernels.segment import segment_max, segment_mean

__all__ = ["ChannelAttention"]


class ChannelAttention(Module):
    r"""Weight the channels of each face by the features of its whole patch.

    .. math::
        \mathbf{x}'_i = \mathbf{x}_i \odot \sigma \left( h_{\Theta} \left( \operatorname{mean}_j \mathbf{x}_j \right)
        + h_{\Theta} \left( \max_j \mathbf{x}_j \right) \right)

    with :math:`j` over the faces of the patch of :math:`i` and one MLP :math:`h_{\Theta}` with a bottleneck, batch
    normalization after both of its linear layers and ReLU between them.
    Source: Woo et al. 2018, Sec. 3.1 (channel half), as used by Li et al. 2020, Sec. 3.3.1.
    Differs: the MLP takes both poolings as one batch, so both are normalized with the same statistics in training and
    in evaluation.
    Differs: a training batch of a single patch is normalized with the running statistics and does not update them,
    since the variance of a single patch is not defined.

    Args:
        channels: Features per face.
        reduction: Factor by which the bottleneck has fewer channels.

    Shapes:
        - **x:** :math:`(F, C)`
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **output:** :math:`(F, C)`

    Raises:
        ValueError: If ``channels`` is less than ``reduction``, or ``x`` does not have ``channels`` columns.

    Example:
        >>> ChannelAttention(8)(torch.ones(5, 8)).shape
        torch.Size([5, 8])
    """

    def __init__(self, channels: int, reduction: int = 4) -> None:
        super().__init__()
        if channels < reduction:
            raise ValueError(
                f"Expected 'channels' of at least the reduction {reduction} (got {channels}). Lower 'reduction'."
            )
        self.channels = channels
        self.reduction = reduction
        self.squeeze = Linear(channels, channels // reduction)
        self.squeeze_norm = BatchNorm1d(channels // reduction)
        self.excite = Linear(channels // reduction, channels)
        self.excite_norm = BatchNorm1d(channels)

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (self.squeeze, self.squeeze_norm, self.excite, self.excite_norm):
            module.reset_parameters()

    def forward(self, x: Tensor, batch: Tensor | None = None, batch_size: int | None = None) -> Tensor:
        """Weight the channels; ``batch_size`` avoids computing the number of patches."""
        if x.size(-1) != self.channels:
            raise ValueError(
                f"Expected 'x' of shape [num_faces, {self.channels}] (got {list(x.shape)}). Change 'channels' or the "
                "features."
            )
        if batch is None:
            pooled = torch.stack([x.mean(dim=0), x.amax(dim=0)])
        else:
            ptr = index2ptr(batch, int(batch[-1]) + 1 if batch_size is None else batch_size)
            pooled = torch.cat([segment_mean(x, ptr), segment_max(x, ptr)])
        hidden = self._normalize(self.squeeze_norm, self.squeeze(pooled)).relu()
        weight = self._normalize(self.excite_norm, self.excite(hidden)).unflatten(0, (2, -1)).sum(dim=0).sigmoid()
        return x * (weight if batch is None else weight[batch])  # (F, C)

    @staticmethod
    def _normalize(norm: BatchNorm1d, pooled: Tensor) -> Tensor:
        if pooled.size(0) > 2:
            return norm(pooled)
        return F.batch_norm(pooled, norm.running_mean, norm.running_var, norm.weight, norm.bias, eps=norm.eps)

    def __repr__(self) -> str:
        return f"{self.__class__.__name__}({self.channels}, reduction={self.reduction})"
