"""Segment reductions over CSR pointers: torch-scatter where it is installed, torch elsewhere."""

from importlib.util import find_spec

import torch
from torch import Tensor

__all__ = ["segment_max", "segment_mean", "segment_sum"]

WITH_TORCH_SCATTER = find_spec("torch_scatter") is not None


def _segment_reduce(src: Tensor, ptr: Tensor, reduce: str) -> Tensor:
    """Reduce the rows of ``src`` between consecutive pointers; a segment without rows gives zeros."""
    if WITH_TORCH_SCATTER and not torch.compiler.is_compiling():
        from torch_scatter import segment_csr

        return segment_csr(src, ptr, reduce=reduce)
    wide = src if src.dtype.itemsize >= 4 else src.float()  # sums of hundreds of bf16 rows stand still
    out = torch.segment_reduce(wide, reduce, offsets=ptr).to(src.dtype)
    return out.masked_fill((ptr[1:] == ptr[:-1]).unsqueeze(-1), 0)


def segment_sum(src: Tensor, ptr: Tensor) -> Tensor:
    """Sum the rows of each segment.

    Args:
        src: Rows in the order of their segments, shape (E, C).
        ptr: Where each segment starts, and the end, shape (S + 1,).

    Returns:
        One row per segment, shape (S, C); zeros for a segment without rows.

    Example:
        >>> segment_sum(torch.tensor([[1.0], [2.0], [4.0]]), torch.tensor([0, 2, 2, 3])).flatten().tolist()
        [3.0, 0.0, 4.0]
    """
    return _segment_reduce(src, ptr, "sum")


def segment_mean(src: Tensor, ptr: Tensor) -> Tensor:
    """Average the rows of each segment; arguments and result as in :func:`segment_sum`.

    Example:
        >>> segment_mean(torch.tensor([[1.0], [2.0], [4.0]]), torch.tensor([0, 2, 2, 3])).flatten().tolist()
        [1.5, 0.0, 4.0]
    """
    return _segment_reduce(src, ptr, "mean")


def segment_max(src: Tensor, ptr: Tensor) -> Tensor:
    """Take the largest value of each column in each segment; arguments and result as in :func:`segment_sum`.

    Example:
        >>> segment_max(torch.tensor([[1.0], [2.0], [-4.0]]), torch.tensor([0, 2, 2, 3])).flatten().tolist()
        [2.0, 0.0, -4.0]
    """
    return _segment_reduce(src, ptr, "max")
