"""Batch normalization of an edge MLP: folded into its linear layers, or from the statistics of the edges."""

import torch
from torch import Tensor
from torch.nn import BatchNorm1d
from torch.nn import functional as F
from torch_geometric.nn import MLP

from dnf_pyg.nn.kernels.fused import edge_max
from dnf_pyg.nn.kernels.recompute import EdgeMax
from dnf_pyg.nn.kernels.rows import Rows

__all__ = ["folded_edge_max", "normalized_edge_max"]


def folded_edge_max(mlp: MLP, u: Tensor, v: Tensor, rows: Rows) -> Tensor:
    """Max over edges of the MLP in evaluation.

    Args:
        mlp: Its first linear layer is done already: ``u`` and ``v`` add up to its result.
        u: Term of the first linear layer for each row, shape (R, C_0).
        v: Term of the first linear layer for each neighbour, shape (N, C_0).
        rows: The edges.

    Returns:
        One row per row, shape (R, C_out).
    """
    scale, shift = _fold(mlp.norms[0].module)
    layers = []
    for lin, norm in zip(mlp.lins[1:], mlp.norms[1:], strict=True):
        lin_scale, lin_shift = _fold(norm.module)
        layers.append(
            (
                (lin.weight * lin_scale.unsqueeze(1)).to(u.dtype),
                (lin.bias * lin_scale + lin_shift).to(u.dtype),
            )
        )
    return edge_max((u * scale + shift).to(u.dtype), (v * scale).to(u.dtype), rows, layers)


def normalized_edge_max(mlp: MLP, u: Tensor, v: Tensor, rows: Rows) -> Tensor:
    """Max over edges of the MLP in training; arguments and result as in :func:`folded_edge_max`."""
    dtype = u.dtype
    stats_dtype = torch.promote_types(dtype, torch.float32)
    u, v = u.to(stats_dtype), v.to(stats_dtype)
    first, *middle, last = [norm.module for norm in mlp.norms]
    mean, var = _sum_moments(u, v, rows)
    _track(first, mean, var, rows.num_edges)
    scale = first.weight * (var + first.eps).rsqrt()
    u, v = u * scale + (first.bias - mean * scale), v * scale

    sign = torch.where(last.weight < 0, -1.0, 1.0).to(
        stats_dtype
    )  # a falling map of the last layer wants its least value
    weight, bias = mlp.lins[-1].weight * sign.unsqueeze(1), mlp.lins[-1].bias * sign
    inner = [
        tensor
        for lin, norm in zip(mlp.lins[1:-1], middle, strict=True)
        for tensor in (lin.weight.to(dtype), lin.bias, norm.weight, norm.bias)
    ]
    eps = [norm.eps for norm in middle]
    largest, mean, var, *moments = EdgeMax.apply(rows, eps, u.to(dtype), v.to(dtype), weight.to(dtype), *inner)
    for norm, norm_mean, norm_var in zip(middle, moments[::2], moments[1::2], strict=True):
        _track(norm, norm_mean, norm_var, rows.num_edges)
    largest, mean = largest.to(stats_dtype) + bias, mean + bias
    _track(last, mean * sign, var, rows.num_edges)
    scale = last.weight * sign * (var + last.eps).rsqrt()
    return (largest * scale + (last.bias - mean * scale)).relu().to(dtype)


def _fold(norm: BatchNorm1d) -> tuple[Tensor, Tensor]:
    """Scale and shift that equal batch normalization in evaluation."""
    mean, var = norm.get_buffer("running_mean"), norm.get_buffer("running_var")
    scale = norm.weight * (var + norm.eps).rsqrt()
    return scale, norm.bias - mean * scale


def _sum_moments(u: Tensor, v: Tensor, rows: Rows) -> tuple[Tensor, Tensor]:
    """Mean and variance of ``u_i + v_j`` over all edges, each shape (C,), without an array of all edges."""
    degree = rows.degree()
    ptr = F.pad(degree.cumsum(0), (1, 0))
    degree = degree.to(u.dtype) / rows.num_edges
    use = torch.bincount(rows.source, minlength=v.size(0)).to(u.dtype) / rows.num_edges
    mean_u, mean_v = degree @ u, use @ v
    u, v = u - mean_u, v - mean_v
    around = F.embedding_bag(rows.source, v, ptr, mode="sum", include_last_offset=True)  # (R, C)
    var = degree @ u.square() + use @ v.square() + (u * around).sum(dim=0) * (2 / rows.num_edges)
    return mean_u + mean_v, var.clamp(min=0)


@torch.no_grad()
def _track(norm: BatchNorm1d, mean: Tensor, var: Tensor, num_edges: int) -> None:
    """Update the running statistics as batch normalization does."""
    count = norm.get_buffer("num_batches_tracked").add_(1)
    momentum = 1 / int(count) if norm.momentum is None else norm.momentum
    unbiased = var * (num_edges / (num_edges - 1))
    for name, value in (("running_mean", mean), ("running_var", unbiased)):
        running = norm.get_buffer(name)
        running.lerp_(value.to(running.dtype), momentum)
