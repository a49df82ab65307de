"""Edges grouped by centre, in blocks that fit the cache."""

from collections.abc import Iterator
from typing import NamedTuple

import torch
from torch import Tensor
from torch_geometric import EdgeIndex

__all__ = ["Block", "Rows"]

BLOCK_NUMBERS = {"cpu": 1 << 19}  # numbers per block and layer: two megabytes in fp32
LARGE_BLOCK_NUMBERS = 1 << 27  # devices that want few large kernels


class Block(NamedTuple):
    """Consecutive rows of equal degree: which rows, which edges, and how many edges a row has."""

    rows: slice
    edges: slice
    degree: int

    @property
    def num_edges(self) -> int:
        """Number of edges in the block."""
        return int(self.edges.stop - self.edges.start)


class Rows(NamedTuple):
    """Edges grouped by centre, centres of equal degree side by side, so that a block of them is a dense array.

    Attributes:
        source: Neighbour of each edge, shape (E,).
        center: Centre of each row, shape (R,); ``None`` if every centre has a row and rows are in their order.
        num_centers: Number of centres, with those that have no edges and therefore no row.
        groups: Number of rows and their degree, for each degree.
    """

    source: Tensor
    center: Tensor | None
    num_centers: int
    groups: list[tuple[int, int]]

    @classmethod
    def from_sorted(cls, edge_index: EdgeIndex) -> "Rows":
        """Group edges that are sorted by centre.

        Example:
            >>> edge_index = EdgeIndex([[0, 1, 0], [0, 0, 2]], sparse_size=(2, 3), sort_order="col")
            >>> rows = Rows.from_sorted(edge_index)
            >>> rows.source.tolist(), rows.center.tolist(), rows.groups
            ([0, 0, 1], [2, 0], [(1, 1), (1, 2)])
        """
        (ptr, source), _ = edge_index.get_csc()
        degree = ptr.diff()
        num_centers = degree.numel()
        if num_centers and source.numel() and bool((degree == degree[0]).all()):
            return cls(source, None, num_centers, [(num_centers, source.numel() // num_centers)])
        degree, center = degree.sort(stable=True)
        start = ptr[center].repeat_interleave(degree)
        first = (degree.cumsum(0) - degree).repeat_interleave(degree)
        source = source[torch.arange(source.numel(), device=source.device) - first + start]
        degrees, counts = degree.unique_consecutive(return_counts=True)
        groups = [(n, d) for n, d in zip(counts.tolist(), degrees.tolist(), strict=True) if d > 0]
        return cls(source, center[num_centers - sum(n for n, _ in groups) :], num_centers, groups)

    @property
    def num_edges(self) -> int:
        """Number of edges."""
        return self.source.numel()

    def degree(self) -> Tensor:
        """Edges of each row, shape (R,)."""
        return torch.cat([self.source.new_full((n,), d) for n, d in self.groups])

    def blocks(self, width: int) -> Iterator[Block]:
        """Cut into blocks whose arrays of ``width`` columns stay in the cache; a row is never cut."""
        numbers = BLOCK_NUMBERS.get(self.source.device.type, LARGE_BLOCK_NUMBERS)
        row = edge = 0
        for num_rows, degree in self.groups:
            step = max(1, numbers // (width * degree))
            for start in range(0, num_rows, step):
                n = min(step, num_rows - start)
                yield Block(slice(row, row + n), slice(edge, edge + n * degree), degree)
                row, edge = row + n, edge + n * degree

    def block_size(self, width: int) -> int:
        """Edges of the largest block."""
        return max(block.num_edges for block in self.blocks(width))

    def pick(self, x: Tensor) -> Tensor:
        """Take the features of the centre of each row, shape (R, C)."""
        return x if self.center is None else x[self.center]

    def spread(self, out: Tensor) -> Tensor:
        """Put results of rows at their centres, zeros at the others, shape (num_centers, C)."""
        if self.center is None:
            return out
        return out.new_zeros(self.num_centers, out.size(1)).index_copy(0, self.center, out)
