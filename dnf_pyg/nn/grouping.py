"""Convolutions that group the features of neighbouring faces."""

from collections.abc import Sequence
from typing import Final

import torch
from torch import Tensor
from torch.nn.parameter import UninitializedParameter
from torch_geometric import EdgeIndex
from torch_geometric.nn import MLP, MessagePassing
from torch_geometric.typing import Adj, OptPairTensor

from dnf_pyg.nn.kernels.edge_mlp import folded_edge_max, normalized_edge_max
from dnf_pyg.nn.kernels.rows import Rows
from dnf_pyg.nn.neighbors import sort_by_center

__all__ = ["FeatureGroupingConv", "NormalGroupingConv", "SurfaceGroupingConv"]


class GroupingConv(MessagePassing):
    r"""Base of the grouping convolutions: the max over edges of an MLP whose first linear layer is split.

    Subclasses implement :meth:`split_first_linear`. Arguments, shapes and errors are those of
    :class:`NormalGroupingConv`.
    """

    SUPPORTS_FUSED_EDGE_INDEX: Final = True

    def __init__(
        self,
        in_channels: int | tuple[int, int],
        out_channels: int,
        hidden_channels: Sequence[int] | None = None,
    ) -> None:
        super().__init__(aggr="max")
        sizes = {in_channels} if isinstance(in_channels, int) else set(in_channels)
        if len(sizes) > 1:
            raise ValueError(
                f"Expected 'in_channels' alike for neighbours and centres (got {in_channels}). The message MLP "
                "compares their features."
            )
        self.in_channels = sizes.pop()
        self.out_channels = out_channels
        self.hidden_channels = [out_channels // 2] * 2 if hidden_channels is None else list(hidden_channels)
        self.mlp = MLP(
            [self.message_channels if self.in_channels > 0 else -1, *self.hidden_channels, out_channels],
            plain_last=False,
            norm_kwargs={"allow_single_element": True},  # a single edge is normalized with the running statistics
        )

    @property
    def message_channels(self) -> int:
        """Number of features that the MLP takes per edge."""
        return 2 * self.in_channels

    def reset_parameters(self) -> None:
        """Draw new weights."""
        super().reset_parameters()
        self.mlp.reset_parameters()

    def forward(self, x: Tensor | tuple[Tensor, Tensor | None], edge_index: Adj) -> Tensor:
        """Embed each centre."""
        x_src, x_dst = (x, None) if isinstance(x, Tensor) else x
        x_dst = x_src if x_dst is None else x_dst
        if self.in_channels < 0:
            self._set_in_channels(x_src)
        for value in (x_src, x_dst):
            if value.size(-1) != self.in_channels:
                raise ValueError(
                    f"Expected 'x' of shape [num_faces, {self.in_channels}] (got {list(value.shape)}). Change "
                    "'in_channels' or the features."
                )
        u, v = self.split_first_linear(x_src, x_dst)
        size = (x_src.size(0), x_dst.size(0))
        if not self.explain and not torch.compiler.is_compiling():
            edge_index = sort_by_center(edge_index, size)
            if not self._can_fuse(edge_index):
                edge_index = edge_index.as_tensor()
        return self.propagate(edge_index, u=(None, u), v=(v, None), size=size)

    def _set_in_channels(self, x: Tensor) -> None:
        """Create the weight of a lazy first linear layer for features like ``x``."""
        self.in_channels = x.size(-1)
        lin = self.mlp.lins[0]
        if isinstance(lin.weight, UninitializedParameter):  # not after loading a state dict
            lin.initialize_parameters(lin, (x.new_empty(0, self.message_channels),))

    def _can_fuse(self, edge_index: EdgeIndex) -> bool:
        """Whether the kernels apply: all norms train on several edges, or none trains and no gradient is needed."""
        training = [norm.module.training for norm in self.mlp.norms]
        if len(training) == 1 or edge_index.size(1) == 0:
            return False
        return edge_index.size(1) > 1 if all(training) else not (any(training) or torch.is_grad_enabled())

    def split_first_linear(self, x_src: Tensor, x_dst: Tensor) -> tuple[Tensor, Tensor]:
        """First linear layer of the MLP as the sum of a term per centre and a term per neighbour."""
        raise NotImplementedError

    def message(self, u_i: Tensor, v_j: Tensor) -> Tensor:
        """Rest of the MLP on each edge, shape (E, C_out)."""
        h = self.mlp.norms[0](u_i + v_j).relu()
        for lin, norm in zip(self.mlp.lins[1:], self.mlp.norms[1:], strict=True):
            h = norm(lin(h)).relu()
        return h

    def message_and_aggregate(self, edge_index: EdgeIndex, u: OptPairTensor, v: OptPairTensor) -> Tensor:
        """Messages and their max in blocks of centres, the same numbers without arrays of all edges."""
        rows = Rows.from_sorted(edge_index)
        run = normalized_edge_max if self.mlp.norms[0].module.training else folded_edge_max
        return rows.spread(run(self.mlp, rows.pick(u[1]), v[0], rows))

    def __repr__(self) -> str:
        return (
            f"{self.__class__.__name__}({self.in_channels}, {self.out_channels}, "
            f"hidden_channels={self.hidden_channels})"
        )


class NormalGroupingConv(GroupingConv):
    r"""Embed each face from its own normal and those of its neighbours.

    .. math::
        \mathbf{x}'_i = \max_{j \in \mathcal{N}(i)} h_{\Theta}(\mathbf{x}_i \Vert \mathbf{x}_j)

    with a shared MLP :math:`h_{\Theta}`, batch normalization and ReLU after each of its linear layers.
    :class:`FeatureGroupingConv` equals :class:`torch_geometric.nn.EdgeConv` with this MLP. It is faster because the
    first linear layer is split into a term per centre and a term per neighbour (two products per face and none per
    edge), and because the rest of the MLP and the max run in blocks of centres that fit the cache
    (:mod:`dnf_pyg.nn.kernels`). With gradients in evaluation mode, in ``explain`` and inside ``torch.compile``, the
    layer is ordinary message passing.
    Source: Li et al. 2020, Sec. 3.3.1 (normal grouping layer, feature extraction layer).

    Args:
        in_channels: Features per face on input (3 for facet normals), or that number for neighbours and centres; -1
            to take it from the first input.
        out_channels: Features per face on output.
        hidden_channels: Width of each hidden layer; two layers of half of ``out_channels`` if ``None``.

    Shapes:
        - **x:** :math:`(F, C_{in})`, or a pair :math:`(F_s, C_{in}), (F_t, C_{in})` of neighbours and centres; with
          ``None`` in the second place, the centres are the neighbours
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1), any order, any degree; also an
          :class:`~torch_geometric.EdgeIndex` or a sparse matrix of shape :math:`(F_t, F_s)`
        - **output:** :math:`(F_t, C_{out})`; zeros for a face without neighbours

    Raises:
        ValueError: If ``x`` does not have ``in_channels`` columns, or ``in_channels`` is a pair of two numbers.

    Example:
        >>> conv = NormalGroupingConv(3, 16)
        >>> conv(torch.randn(4, 3), torch.tensor([[1, 2, 0], [0, 0, 1]])).shape
        torch.Size([4, 16])
    """

    def split_first_linear(self, x_src: Tensor, x_dst: Tensor) -> tuple[Tensor, Tensor]:
        """First linear layer of the MLP on :math:`[x_i, x_j]`, split over its two halves."""
        lin = self.mlp.lins[0]
        own, other = lin.weight.split(self.in_channels, dim=1)
        return torch.addmm(lin.bias, x_dst, own.t()), x_src @ other.t()


class FeatureGroupingConv(GroupingConv):
    r"""Embed each face from its own features and their differences to its neighbours'.

    .. math::
        \mathbf{x}'_i = \max_{j \in \mathcal{N}(i)} h_{\Theta}(\mathbf{x}_i \Vert \mathbf{x}_j - \mathbf{x}_i)

    Arguments, shapes and errors are those of :class:`NormalGroupingConv`.
    Source: Li et al. 2020, Sec. 3.3.1 (feature grouping layer, feature extraction layer).

    Example:
        >>> conv = FeatureGroupingConv(64, 128)
        >>> conv(torch.randn(4, 64), torch.tensor([[1, 2, 0], [0, 0, 1]])).shape
        torch.Size([4, 128])
    """

    def split_first_linear(self, x_src: Tensor, x_dst: Tensor) -> tuple[Tensor, Tensor]:
        """First linear layer of the MLP on :math:`[x_i, x_j - x_i]`, split likewise."""
        lin = self.mlp.lins[0]
        own, difference = lin.weight.split(self.in_channels, dim=1)
        return torch.addmm(lin.bias, x_dst, (own - difference).t()), x_src @ difference.t()


class SurfaceGroupingConv(GroupingConv):
    r"""Embed each face from its features, their differences to its neighbours', and where these lie.

    .. math::
        \mathbf{x}'_i = \max_{j \in \mathcal{N}(i)}
            h_{\Theta}(\mathbf{x}_i \Vert \mathbf{x}_j - \mathbf{x}_i \Vert \mathbf{c}_j - \mathbf{c}_i)

    Only differences of places enter, so the result does not change when the mesh is moved. Their origin should be
    near, since bf16 keeps few digits of the difference of two large numbers. The last three columns of ``x``, which
    ``in_channels`` counts, are the place :math:`\mathbf{c}`. Shapes, errors and the other arguments are those of
    :class:`NormalGroupingConv`.
    Differs: the paper groups normals and features alone.

    Example:
        >>> conv = SurfaceGroupingConv(3 + 1 + 3, 16)
        >>> conv(torch.randn(4, 7), torch.tensor([[1, 2, 0], [0, 0, 1]])).shape
        torch.Size([4, 16])
    """

    @property
    def message_channels(self) -> int:
        """Number of features that the MLP takes per edge."""
        return 2 * self.in_channels - 3

    def split_first_linear(self, x_src: Tensor, x_dst: Tensor) -> tuple[Tensor, Tensor]:
        """First linear layer of the MLP, split into a term per centre and a term per neighbour."""
        lin = self.mlp.lins[0]
        own, difference = lin.weight.split([self.in_channels - 3, self.in_channels], dim=1)
        own = torch.nn.functional.pad(own, (0, 3))  # only differences of places enter
        return torch.addmm(lin.bias, x_dst, (own - difference).t()), x_src @ difference.t()
