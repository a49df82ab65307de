"""Inference over edges, block by block, without arrays of all edges."""

import torch
from torch import Tensor

from dnf_pyg.nn.kernels.rows import Block, Rows

__all__ = ["Scratch", "edge_max", "first_activation"]


class Scratch:
    """Arrays of one block, allocated once and used again for every block.

    Example:
        >>> scratch = Scratch(torch.zeros(1), num_edges=8)
        >>> scratch("a", 5, 3).shape, scratch("a", 8, 3).shape
        (torch.Size([5, 3]), torch.Size([8, 3]))
    """

    def __init__(self, like: Tensor, num_edges: int) -> None:
        self.like, self.num_edges = like, num_edges
        self.arrays: dict[str, Tensor] = {}

    def __call__(self, name: str, num_edges: int, width: int, dtype: torch.dtype | None = None) -> Tensor:
        """Take the first rows of the array of that name."""
        if name not in self.arrays:
            self.arrays[name] = self.like.new_empty(self.num_edges, width, dtype=dtype)
        return self.arrays[name][:num_edges]


def first_activation(u: Tensor, v: Tensor, rows: Rows, block: Block, out: Tensor) -> Tensor:
    """Write ``relu(u_i + v_j)`` on the edges of a block to ``out``."""
    torch.index_select(v, 0, rows.source[block.edges], out=out)
    out.view(-1, block.degree, out.size(1)).add_(u[block.rows].unsqueeze(1))
    return out.relu_()


@torch.no_grad()
def edge_max(u: Tensor, v: Tensor, rows: Rows, layers: list[tuple[Tensor, Tensor]]) -> Tensor:
    r"""Largest value, per row, of a folded MLP on :math:`\mathrm{relu}(u_i + v_j)`, with ReLU after each layer.

    Bias and ReLU of the last layer do not change which edge is largest and come after the max.

    Args:
        u: Term of the first layer for each row, shape (R, C_0).
        v: Term of the first layer for each neighbour, shape (N, C_0).
        rows: The edges.
        layers: Weight (C_l, C_{l-1}) and bias (C_l,) of each further layer, at least one.

    Returns:
        One row per row, shape (R, C_L).

    Example:
        >>> rows = Rows(torch.tensor([0, 1]), None, 1, [(1, 2)])
        >>> edge_max(torch.zeros(1, 1), torch.tensor([[1.0], [3.0]]), rows, [(torch.ones(1, 1), torch.ones(1))])
        tensor([[4.]])
    """
    *inner, (weight, bias) = layers
    width = max(u.size(1), *(w.size(0) for w, _ in layers))
    scratch = Scratch(u, rows.block_size(width))
    out = u.new_empty(u.size(0), weight.size(0))
    for block in rows.blocks(width):
        n = block.num_edges
        a = first_activation(u, v, rows, block, scratch("first", n, u.size(1)))
        for level, (w, b) in enumerate(inner):
            a = torch.addmm(b, a, w.t(), out=scratch(f"inner {level}", n, w.size(0))).relu_()
        z = torch.mm(a, weight.t(), out=scratch("last", n, weight.size(0)))
        torch.amax(z.view(-1, block.degree, z.size(1)), dim=1, out=out[block.rows])
    return out.add_(bias).relu_()
