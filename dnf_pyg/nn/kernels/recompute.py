"""Training over edges, block by block: little is kept, the rest is computed again in the backward pass."""

from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn import functional as F

from dnf_pyg.nn.kernels.fused import Scratch, first_activation
from dnf_pyg.nn.kernels.rows import Block, Rows

__all__ = ["EdgeMax"]


class _Stage(NamedTuple):
    """An inner layer: its product (E, C) with an offset, and batch normalization as scale and shift of it."""

    z: Tensor
    scale: Tensor
    shift: Tensor
    mean: Tensor
    rstd: Tensor


class _Edges(NamedTuple):
    """What the activations of any layer are computed from."""

    rows: Rows
    scratch: Scratch
    u: Tensor
    v: Tensor
    stages: list[_Stage]

    def activation(self, level: int, block: Block) -> Tensor:
        """Input of the linear layer ``level`` (0: the first inner one) on a block; overwritten by the next call."""
        if level == 0:
            out = self.scratch("first", block.num_edges, self.u.size(1))
            return first_activation(self.u, self.v, self.rows, block, out)
        stage = self.stages[level - 1]
        out = self.scratch(f"inner {level}", block.num_edges, stage.z.size(1))
        return torch.addcmul(stage.shift, stage.z[block.edges], stage.scale, out=out).relu_()


def _inner_layer(edges: _Edges, width: int, params: tuple[Tensor, ...], eps: float) -> tuple[_Stage, Tensor, Tensor]:
    """Product of an inner layer on all edges, and its mean and variance."""
    weight, bias, gamma, beta = params
    rows, level = edges.rows, len(edges.stages)
    z = weight.new_empty(rows.num_edges, weight.size(0))
    dtype = torch.promote_types(z.dtype, torch.float32)
    total = torch.zeros(2, weight.size(0), dtype=dtype, device=z.device)
    offset = None  # minus the mean of the first block: keeps the sums of squares small
    for block in rows.blocks(width):
        a = edges.activation(level, block)
        if offset is None:
            offset = -(weight @ a.mean(dim=0))
        product = torch.addmm(offset, a, weight.t(), out=z[block.edges])
        square = edges.scratch(f"square {level}", block.num_edges, z.size(1), dtype)
        total[0] += product.sum(dim=0, dtype=dtype)
        total[1] += torch.mul(product, product, out=square).sum(dim=0)
    mean, square_mean = total / rows.num_edges
    var = (square_mean - mean.square()).clamp(min=0)
    rstd = (var + eps).rsqrt()
    scale = gamma * rstd
    stage = _Stage(z, scale.to(z.dtype), (beta - mean * scale).to(z.dtype), mean, rstd)
    return stage, mean - offset + bias, var


class EdgeMax(torch.autograd.Function):
    r"""Max per row, and mean and variance over all edges, of the last linear layer of an edge MLP in training.

    The MLP takes :math:`a = \mathrm{relu}(u_i + v_j)` through inner layers (linear, batch normalization with the
    statistics of these edges, ReLU) to a bare linear layer :math:`W`. Kept for the backward pass are the products of
    the inner layers; all else is computed again, block by block. The gradients are exact: the max passes its own to
    the first of the largest edges, and mean and variance of the last layer are :math:`W \mu` and
    :math:`\operatorname{diag}(W \Sigma W^\top)` for activations of mean :math:`\mu` and covariance :math:`\Sigma`, so
    that their gradient needs one square product per edge instead of two with :math:`W`.
    """

    @staticmethod
    def forward(
        ctx: Any, rows: Rows, eps: list[float], u: Tensor, v: Tensor, weight: Tensor, *inner: Tensor
    ) -> tuple[Tensor, ...]:
        """Run the layers.

        Args:
            ctx: Context of the backward pass.
            rows: The edges.
            eps: Batch normalization's epsilon of each inner layer.
            u: Term of the first layer for each row, normalized, shape (R, C_0).
            v: Term of the first layer for each neighbour, normalized, shape (N, C_0).
            weight: Last linear layer, shape (C, C_h).
            inner: Weight, bias, scale and shift of each inner layer, one after the other.

        Returns:
            Max (R, C), mean (C,), variance (C,); then mean and variance of each inner layer, not differentiable.
        """
        layers = [inner[i : i + 4] for i in range(0, len(inner), 4)]
        width = max(u.size(1), weight.size(0), *(w.size(0) for w in inner[::4]), 1)
        dtype = torch.promote_types(u.dtype, torch.float32)
        with torch.autocast(u.device.type, enabled=False):
            scratch = Scratch(u, rows.block_size(width))
            edges = _Edges(rows, scratch, u, v, [])
            inner_moments: list[Tensor] = []
            for params, layer_eps in zip(layers, eps, strict=True):
                stage, *moments = _inner_layer(edges, width, params, layer_eps)
                edges.stages.append(stage)
                inner_moments += moments

            out = u.new_empty(u.size(0), weight.size(0))
            position = torch.empty_like(out, dtype=torch.int32)  # of the largest edge in its row
            mean = torch.zeros(weight.size(1), dtype=dtype, device=u.device)
            cov = torch.zeros(weight.size(1), weight.size(1), dtype=dtype, device=u.device)
            for block in rows.blocks(width):
                a = edges.activation(len(layers), block)
                z = torch.mm(a, weight.t(), out=scratch("last", block.num_edges, weight.size(0)))
                z = z.view(-1, block.degree, z.size(1))
                out[block.rows] = largest = z.amax(dim=1)
                is_largest = scratch("largest", block.num_edges, weight.size(0), dtype).view_as(z)
                torch.eq(z, largest.unsqueeze(1), out=is_largest)
                countdown = torch.arange(block.degree, 0, -1, dtype=dtype, device=z.device).view(-1, 1)
                position[block.rows] = (block.degree - is_largest.mul_(countdown).amax(dim=1).clamp_(min=1)).int()
                a = a.to(dtype)
                mean += a.sum(dim=0)
                cov.addmm_(a.t(), a)
            mean /= rows.num_edges
            cov = (cov / rows.num_edges).addr_(mean, mean, alpha=-1)

            ctx.rows, ctx.width = rows, width
            stages = [tensor for stage in edges.stages for tensor in stage]
            ctx.save_for_backward(u, v, weight, mean, cov, position, *inner[::4], *stages)
            ctx.mark_non_differentiable(*inner_moments)
            last = weight.to(dtype)
            return out, last @ mean, ((last @ cov) * last).sum(dim=1).clamp(min=0), *inner_moments

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, ...]:
        """Pass the gradients back through the last layer, then through each inner layer."""
        u, v, weight, mean, cov, position, *rest = ctx.saved_tensors
        num_inner = len(rest) // 6
        weights, tensors = rest[:num_inner], rest[num_inner:]
        stages = [_Stage(*tensors[i : i + 5]) for i in range(0, len(tensors), 5)]
        with torch.autocast(u.device.type, enabled=False):
            scratch = Scratch(u, ctx.rows.block_size(ctx.width))
            edges = _Edges(ctx.rows, scratch, u, v, stages)
            sink = _Sink(edges, ctx.width)
            d_weight = _last_backward(edges, sink, weight, mean, cov, position, *grads[:3])
            d_inner: list[Tensor] = []
            for level in reversed(range(num_inner)):
                d_inner = [*_inner_backward(edges, sink, level, weights[level]), *d_inner]
        return None, None, sink.d_u, sink.d_v, d_weight, *d_inner


class _Sink:
    """Where the gradient of an activation goes: past its ReLU, to the buffer of a layer or to ``u`` and ``v``."""

    def __init__(self, edges: _Edges, width: int) -> None:
        self.edges, self.width = edges, width
        self.d_u, self.d_v = torch.empty_like(edges.u), torch.zeros_like(edges.v)
        self.d_z: list[Tensor] = [torch.empty_like(stage.z) for stage in edges.stages]
        self.sums = [torch.zeros(2, s.z.size(1), dtype=s.mean.dtype, device=s.z.device) for s in edges.stages]

    def grad(self, level: int, block: Block) -> Tensor:
        """Array to write the gradient of the activation to."""
        if level:
            return self.d_z[level - 1][block.edges]
        return self.edges.scratch("d first", block.num_edges, self.d_u.size(1))

    def put(self, level: int, block: Block, grad: Tensor, activation: Tensor) -> None:
        """Take the gradient of an activation; the activation is used up."""
        grad.mul_(activation.sign_())
        if level:
            total = self.sums[level - 1]
            total[0] += grad.sum(dim=0, dtype=total.dtype)
            total[1] += torch.mul(grad, self.edges.stages[level - 1].z[block.edges], out=activation).sum(
                dim=0, dtype=total.dtype
            )
        else:
            torch.sum(grad.view(-1, block.degree, grad.size(1)), dim=1, out=self.d_u[block.rows])
            self.d_v.index_add_(0, self.edges.rows.source[block.edges], grad)


def _last_backward(
    edges: _Edges,
    sink: _Sink,
    weight: Tensor,
    mean: Tensor,
    cov: Tensor,
    position: Tensor,
    d_out: Tensor,
    d_mean: Tensor,
    d_var: Tensor,
) -> Tensor:
    """Backward of max, mean and variance of the last layer; returns the gradient of its weight."""
    level, num_edges = len(edges.stages), edges.rows.num_edges
    last = weight.to(mean.dtype)
    square = last.t() @ (last * (d_var * 2 / num_edges).unsqueeze(1))  # a -> its gradient from the variance
    constant = (last.t() @ d_mean / num_edges - square @ mean).to(weight.dtype)
    square = square.to(weight.dtype)
    d_weight = torch.outer(d_mean, mean) + 2 * d_var.unsqueeze(1) * (last @ cov)
    for block in edges.rows.blocks(sink.width):
        a = edges.activation(level, block)
        grad = torch.addmm(constant, a, square, out=sink.grad(level, block))
        first = torch.arange(0, block.num_edges, block.degree, device=a.device).unsqueeze(1)
        largest = position[block.rows] + first  # (rows, C) edge of the block
        d_largest = d_out[block.rows].to(weight.dtype)
        channel = largest.sort(dim=1).indices  # channels of a row in the order of their edges
        ends = torch.bincount(largest.flatten(), minlength=block.num_edges).cumsum(0)
        grad += _weighted_sums(channel.flatten(), weight, F.pad(ends, (1, 0)), d_largest.gather(1, channel).flatten())
        ptr = torch.arange(0, largest.numel() + 1, largest.size(0), device=a.device)
        d_weight += _weighted_sums(largest.t().flatten(), a, ptr, d_largest.t().flatten())
        sink.put(level, block, grad, a)
    return d_weight.to(weight.dtype)


def _weighted_sums(index: Tensor, table: Tensor, ptr: Tensor, factor: Tensor) -> Tensor:
    """Sum rows of a table, each with its factor, between consecutive pointers."""
    return F.embedding_bag(index, table, ptr, mode="sum", per_sample_weights=factor, include_last_offset=True)


def _inner_backward(edges: _Edges, sink: _Sink, level: int, weight: Tensor) -> tuple[Tensor, ...]:
    """Backward of an inner layer; returns the gradients of its weight, bias, scale and shift."""
    stage, d_z, num_edges = edges.stages[level], sink.d_z[level], edges.rows.num_edges
    d_beta, d_gamma = sink.sums[level]
    d_gamma = stage.rstd * (d_gamma - stage.mean * d_beta)
    slope = -stage.scale * stage.rstd * d_gamma / num_edges  # of the term that the statistics add
    constant = -stage.scale * d_beta / num_edges - slope * stage.mean
    slope, constant = slope.to(d_z.dtype), constant.to(d_z.dtype)
    d_weight = torch.zeros_like(weight, dtype=stage.mean.dtype)
    for block in edges.rows.blocks(sink.width):
        grad = d_z[block.edges]
        statistics = edges.scratch(f"statistics {level}", block.num_edges, grad.size(1))
        torch.addcmul(constant, stage.z[block.edges], slope, out=statistics)
        torch.addcmul(statistics, grad, stage.scale, out=grad)
        a = edges.activation(level, block)
        d_weight += grad.t() @ a
        sink.put(level, block, torch.mm(grad, weight, out=sink.grad(level, block)), a)
    return d_weight, torch.zeros_like(d_beta), d_gamma, d_beta
