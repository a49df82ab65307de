"""Multi-scale feature embedding unit."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import Module, ModuleList
from torch_geometric.nn import MLP
from torch_geometric.typing import Adj

from dnf_pyg.nn.attention import ChannelAttention
from dnf_pyg.nn.grouping import FeatureGroupingConv, NormalGroupingConv, SurfaceGroupingConv

__all__ = ["MultiScaleEmbedding"]


class MultiScaleEmbedding(Module):
    r"""Embed facet normals with growing neighbourhoods and fuse what all levels found.

    Level :math:`l` groups the :math:`k_l` nearest faces (normals on the first level, features above) and weights its
    channels by attention over the patch; one layer fuses the normals and all levels.
    Source: Li et al. 2020, Sec. 3.3.1 and Fig. 5.

    Args:
        k: Neighbours per face on each level.
        channels: Features per face after each level.
        out_channels: Features per face after fusing.
        subtract: Group differences of features on the levels above the first (the paper's Table 1 has it without).
        surface: Every level sees where the neighbours lie (:class:`~dnf_pyg.nn.SurfaceGroupingConv`), the first one
            areas as well. Differs: the paper has normals alone.

    Shapes:
        - **normal:** :math:`(F, 3)`
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1), nearest first; or one per level
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **surface:** :math:`(F, 4)`, place and relative size as :func:`~dnf_pyg.nn.surface.patch_surface` gives them
        - **output:** :math:`(F, C_{out})`

    Raises:
        ValueError: If ``k`` and ``channels`` differ in length, or ``edge_index`` is a list of another length.

    Example:
        >>> embedding = MultiScaleEmbedding(k=(1, 2), channels=(8, 16), out_channels=4)
        >>> embedding(torch.randn(3, 3), torch.tensor([[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]])).shape
        torch.Size([3, 4])
    """

    def __init__(
        self,
        k: Sequence[int] = (10, 30, 50),
        channels: Sequence[int] = (64, 128, 256),
        out_channels: int = 128,
        subtract: bool = True,
        surface: bool = False,
    ) -> None:
        super().__init__()
        if len(k) != len(channels):
            raise ValueError(f"Expected 'k' and 'channels' of equal length (got {list(k)} and {list(channels)})")
        sizes = [4 if surface else 3, *channels]
        deeper = FeatureGroupingConv if subtract else NormalGroupingConv
        layers = [SurfaceGroupingConv] * len(k) if surface else [NormalGroupingConv] + [deeper] * (len(k) - 1)
        place = 3 if surface else 0
        self.convs = ModuleList(
            layer(size + place, channel, k=k_level)
            for layer, size, channel, k_level in zip(layers, sizes[:-1], channels, k, strict=True)
        )
        self.attentions = ModuleList(ChannelAttention(c) for c in channels)
        self.fuse = MLP([sum(sizes), out_channels], plain_last=False, norm_kwargs={"allow_single_element": True})

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (*self.convs, *self.attentions, self.fuse):
            module.reset_parameters()

    def forward(
        self,
        normal: Tensor,
        edge_index: Adj | Sequence[Adj],
        batch: Tensor | None = None,
        batch_size: int | None = None,
        surface: Tensor | None = None,
    ) -> Tensor:
        """Embed each face; ``batch_size`` saves a look at ``batch``."""
        per_level = edge_index if isinstance(edge_index, list | tuple) else [edge_index] * len(self.convs)
        if len(per_level) != len(self.convs):
            raise ValueError(f"Expected 'edge_index' for each of {len(self.convs)} levels (got {len(per_level)})")
        levels = [normal if surface is None else torch.cat([normal, surface[:, 3:]], dim=-1)]
        for conv, attention, edges in zip(self.convs, self.attentions, per_level, strict=True):
            x = levels[-1] if surface is None else torch.cat([levels[-1], surface[:, :3]], dim=-1)
            levels.append(attention(conv(x, edges), batch, batch_size))
        return self.fuse(torch.cat(levels, dim=-1))
