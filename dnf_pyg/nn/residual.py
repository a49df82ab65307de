"""Residual learning unit."""

from torch import Tensor
from torch.nn import Module

from dnf_pyg.nn.grouping import FeatureGroupingConv
from dnf_pyg.nn.neighbors import feature_neighbors

__all__ = ["ResidualUnit"]


class ResidualUnit(Module):
    r"""Estimate the noise in a feature map from the most similar faces of the patch.

    .. math::
        \Delta\mathbf{x}_i = \max_{j \in \mathcal{N}_x(i)} h_{\Theta}(\mathbf{x}_i \Vert \mathbf{x}_j - \mathbf{x}_i)

    with the :math:`k` faces :math:`\mathcal{N}_x(i)` of the same patch that are nearest in feature space.
    Source: Li et al. 2020, Sec. 3.3.2 and Fig. 7.
    Differs: the paper's text groups the features of the neighbours, the authors' code their differences, as here.

    Args:
        channels: Features per face, on input and output.
        k: Neighbours per face, the face itself included; a patch with fewer faces uses all of them.

    Shapes:
        - **x:** :math:`(F, C)`
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **output:** :math:`(F, C)`, to be subtracted from ``x``

    Raises:
        ValueError: If ``k`` is not positive.

    Example:
        >>> import torch
        >>> ResidualUnit(8, k=3)(torch.randn(5, 8), torch.tensor([0, 0, 0, 1, 1])).shape
        torch.Size([5, 8])
    """

    def __init__(self, channels: int, k: int = 20) -> None:
        super().__init__()
        if k < 1:
            raise ValueError(f"Expected 'k' of a residual unit of at least 1 (got {k}). Raise it.")
        self.channels = channels
        self.k = k
        self.conv = FeatureGroupingConv(channels, channels, hidden_channels=[channels])

    def reset_parameters(self) -> None:
        """Draw new weights."""
        self.conv.reset_parameters()

    def forward(self, x: Tensor, batch: Tensor | None = None) -> Tensor:
        """Estimate the residual."""
        return self.conv(x, feature_neighbors(x, self.k, batch))

    def __repr__(self) -> str:
        return f"{self.__class__.__name__}({self.channels}, k={self.k})"
