"""Multi-scale feature embedding unit."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import Module, ModuleList
from torch_geometric.nn import MLP
from torch_geometric.typing import Adj

from dnf_pyg.nn.attention import ChannelAttention
from dnf_pyg.nn.grouping import FeatureGroupingConv, GroupingConv, NormalGroupingConv
from dnf_pyg.nn.neighbors import edges_per_level

__all__ = ["MultiScaleEmbedding"]


class MultiScaleEmbedding(Module):
    r"""Embed facet normals over growing neighbourhoods and fuse the features of all levels.

    Level :math:`l` groups the :math:`k_l` nearest faces (normals on the first level, features above) and weights its
    channels by attention over the patch. One layer fuses the normals and the features of all levels.
    Source: Li et al. 2020, Sec. 3.3.1 and Fig. 5.
    Differs: the paper's text puts attention in place of the MLP of a level, the authors' code after it, as here.

    Args:
        k: Neighbours per face on each level.
        channels: Features per face after each level.
        out_channels: Features per face after fusing.
        subtract: Group differences of features on the levels above the first (the paper's Table 1 has it without).
        in_channels: Features per face on input; 3 for facet normals.

    Shapes:
        - **x:** :math:`(F, C_{in})`
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1); or a list with the edges of each level
        - **edge_attr:** :math:`(E)`, rank of the neighbour, 0 for the face itself; not needed with a list of edges
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **output:** :math:`(F, C_{out})`

    Raises:
        ValueError: If ``k`` and ``channels`` differ in length, ``edge_attr`` is missing, ``edge_index`` is a list of
            another length, or ``x`` has other columns.

    Example:
        >>> embedding = MultiScaleEmbedding(k=(1, 2), channels=(8, 16), out_channels=4)
        >>> edge_index, rank = torch.tensor([[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]]), torch.tensor([0, 1, 0, 1, 0, 1])
        >>> embedding(torch.randn(3, 3), edge_index, rank).shape
        torch.Size([3, 4])
    """

    def __init__(
        self,
        k: Sequence[int] = (10, 30, 50),
        channels: Sequence[int] = (64, 128, 256),
        out_channels: int = 128,
        subtract: bool = True,
        in_channels: int = 3,
    ) -> None:
        super().__init__()
        if len(k) != len(channels):
            raise ValueError(
                f"Expected 'k' and 'channels' of equal length (got {list(k)} and {list(channels)}). Give one number of "
                "each for every level."
            )
        self.k = tuple(k)
        self.in_channels = in_channels
        self.subtract = subtract
        sizes = [in_channels, *channels]
        self.convs = ModuleList(self.make_conv(level, *sizes[level : level + 2]) for level in range(len(k)))
        self.attentions = ModuleList(ChannelAttention(size) for size in channels)
        self.fuse = MLP([sum(sizes), out_channels], plain_last=False, norm_kwargs={"allow_single_element": True})

    @property
    def input_channels(self) -> int:
        """Number of columns of ``x``."""
        return self.in_channels

    def make_conv(self, level: int, in_channels: int, out_channels: int) -> GroupingConv:
        """Make the grouping layer of a level."""
        layer = FeatureGroupingConv if level > 0 and self.subtract else NormalGroupingConv
        return layer(in_channels, out_channels)

    def grouping_input(self, features: Tensor, x: Tensor) -> Tensor:
        """Features that a level groups: those of the level below."""
        return features

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (*self.convs, *self.attentions, self.fuse):
            module.reset_parameters()

    def forward(
        self,
        x: Tensor,
        edge_index: Tensor | Sequence[Adj],
        edge_attr: Tensor | None = None,
        batch: Tensor | None = None,
        batch_size: int | None = None,
    ) -> Tensor:
        """Embed each face; ``batch_size`` avoids computing the number of patches."""
        if x.size(-1) != self.input_channels:
            raise ValueError(
                f"Expected 'x' of shape [num_faces, {self.input_channels}] (got {list(x.shape)}). Change 'in_channels' "
                "or the features."
            )
        levels = [x[:, : self.in_channels]]
        edges = edges_per_level(edge_index, edge_attr, self.k)
        for conv, attention, level_edges in zip(self.convs, self.attentions, edges, strict=True):
            grouped = conv(self.grouping_input(levels[-1], x), level_edges)
            levels.append(attention(grouped, batch, batch_size))
        return self.fuse(torch.cat(levels, dim=-1))
