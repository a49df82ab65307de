"""The training loss: deeply supervised normal recovery and residual regularization (paper section 3.4)."""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch_geometric.utils import scatter

__all__ = ["JointLoss", "LossTerms", "NormalDistance", "SquaredNormalDistance"]


class SquaredNormalDistance(torch.nn.Module):
    r"""Squared Euclidean distance :math:`\|\mathbf{n} - \mathbf{n}^G\|^2` of each pair of unit normals (Eq. 1).

    Example:
        >>> SquaredNormalDistance()(torch.tensor([[1.0, 0.0, 0.0]]), torch.tensor([[0.0, 1.0, 0.0]]))
        tensor([2.])
    """

    def forward(self, normal: Tensor, clean_normal: Tensor) -> Tensor:
        """Compare normals (F, 3) with their targets (F, 3); one value per face (F,)."""
        return (normal - clean_normal).square().sum(dim=-1)


class NormalDistance(torch.nn.Module):
    r"""Euclidean distance :math:`\|\mathbf{n} - \mathbf{n}^G\|` of each pair of unit normals.

    Differs: the paper trains on the square; the distance follows the reported angle more closely late in training.

    Args:
        eps: Smoothing at zero, in units of the distance; keeps the gradient finite.
    """

    def __init__(self, eps: float = 1e-3) -> None:
        super().__init__()
        self.eps = eps

    def forward(self, normal: Tensor, clean_normal: Tensor) -> Tensor:
        """Compare normals (F, 3) with their targets (F, 3); one value per face (F,)."""
        return ((normal - clean_normal).square().sum(dim=-1) + self.eps**2).sqrt() - self.eps


class LossTerms(NamedTuple):
    """The joint loss and its two terms, each a scalar; ``total = recovery + alpha * residual``."""

    total: Tensor
    recovery: Tensor
    residual: Tensor


class JointLoss(torch.nn.Module):
    r"""Deeply supervised joint loss over the residual learning units of one batch of patches.

    .. math::
        L = \frac{1}{N_p} \sum_{i=1}^{N_p} \sum_u \|\mathbf{N}^G_i - \mathbf{N}^u_i\|^2
            + \alpha \|\Delta \mathbf{F}^u_i\|^2

    Both norms are means over the faces of a patch, then over the patches, so that :math:`\alpha` keeps its meaning
    whatever the size of a patch.

    Source: Li et al. 2020, Sec. 3.4, Eqs. (1)-(3).
    Differs: the authors' published code weighs the residual term by 0.05, not by the paper's 0.5.

    Args:
        alpha: Weight of the residual regularization; 0 is the paper's ablation "w/o reg".
        intermediate_weight: Weight of every output but the last; 0 is the paper's ablation "w/o inter".
        distance: Distance between filtered and clean normals, one value per face.

    Example:
        >>> normal = torch.tensor([[0.0, 0.0, 1.0]])
        >>> terms = JointLoss(alpha=0.5)([(normal, torch.ones(1, 4))], normal)
        >>> terms.total, terms.residual
        (tensor(2.), tensor(4.))
    """

    def __init__(
        self, alpha: float = 0.5, intermediate_weight: float = 1.0, distance: torch.nn.Module | None = None
    ) -> None:
        super().__init__()
        self.alpha = alpha
        self.intermediate_weight = intermediate_weight
        self.distance = SquaredNormalDistance() if distance is None else distance

    def forward(
        self, stages: Sequence[tuple[Tensor, Tensor]], clean_normal: Tensor, batch: Tensor | None = None
    ) -> LossTerms:
        """Compute the loss of one batch.

        Args:
            stages: Filtered normals (F, 3) and residual features (F, C) of each residual learning unit, first to last.
            clean_normal: Target normals (F, 3), unit length.
            batch: Patch of each face (F,); one patch if not given.

        Returns:
            The scalar terms.
        """
        recovery = clean_normal.new_zeros(())
        residual = clean_normal.new_zeros(())
        for unit, (normal, feature) in enumerate(stages):
            weight = 1.0 if unit == len(stages) - 1 else self.intermediate_weight
            recovery = recovery + weight * _patch_mean(self.distance(_at_least_float32(normal), clean_normal), batch)
            residual = residual + _patch_mean(_at_least_float32(feature).square().sum(dim=-1), batch)
        return LossTerms(recovery + self.alpha * residual, recovery, residual)


def _patch_mean(value: Tensor, batch: Tensor | None) -> Tensor:
    """Mean over the faces of each patch, then over the patches."""
    return value.mean() if batch is None else scatter(value, batch, reduce="mean").mean()


def _at_least_float32(value: Tensor) -> Tensor:
    return value.to(torch.promote_types(value.dtype, torch.float32))
