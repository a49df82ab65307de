"""Multi-scale embedding that sees where the faces lie."""

from collections.abc import Sequence

import torch
from torch import Tensor

from dnf_pyg.nn.embedding import MultiScaleEmbedding
from dnf_pyg.nn.grouping import SurfaceGroupingConv

__all__ = ["SurfaceEmbedding"]


class SurfaceEmbedding(MultiScaleEmbedding):
    """Embed facet normals, areas and places over growing neighbourhoods and fuse the features of all levels.

    Every level sees where the neighbours lie (:class:`~dnf_pyg.nn.SurfaceGroupingConv`), the first one areas as well.
    Arguments, shapes and errors are those of :class:`MultiScaleEmbedding`.
    Differs: the paper embeds normals alone.

    Args:
        k: Neighbours per face on each level.
        channels: Features per face after each level.
        out_channels: Features per face after fusing.
        in_channels: Features per face on input, without the centroid.

    Shapes:
        - **x:** :math:`(F, C_{in} + 3)`, facet normal, logarithm of the relative area and further features, and last
          the centroid in units of the patch (:func:`~dnf_pyg.nn.surface.patch_surface`)

    Example:
        >>> embedding = SurfaceEmbedding(k=(1, 2), channels=(8, 16), out_channels=4)
        >>> edge_index, rank = torch.tensor([[0, 1, 1, 0], [0, 0, 1, 1]]), torch.tensor([0, 1, 0, 1])
        >>> embedding(torch.randn(2, 7), edge_index, rank).shape
        torch.Size([2, 4])
    """

    def __init__(self, k: Sequence[int], channels: Sequence[int], out_channels: int, in_channels: int = 4) -> None:
        super().__init__(k, channels, out_channels, in_channels=in_channels)

    @property
    def input_channels(self) -> int:
        """Number of columns of ``x``: the features and the place."""
        return self.in_channels + 3

    def make_conv(self, level: int, in_channels: int, out_channels: int) -> SurfaceGroupingConv:
        """Make the grouping layer of a level."""
        return SurfaceGroupingConv(in_channels + 3, out_channels)

    def grouping_input(self, features: Tensor, x: Tensor) -> Tensor:
        """Features that a level groups: those of the level below, and the place."""
        return torch.cat([features, x[:, self.in_channels :]], dim=-1)
