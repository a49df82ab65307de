"""Muon for the weight matrices and AdamW for the rest, as one optimizer."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor
from torch.optim import AdamW, Muon, Optimizer

__all__ = ["MuonAdamW"]


class MuonAdamW(Optimizer):
    """Update the weight matrices by Muon and all other parameters by AdamW.

    Muon orthogonalizes the momentum of each matrix. Its update is scaled to the root mean square of AdamW's, so one
    learning rate serves both.
    Source: Jordan et al. 2024, "Muon: an optimizer for hidden layers in neural networks"; Liu et al. 2025, "Muon is
    scalable for LLM training", for the scale.
    Differs: :class:`torch.optim.Muon` rounds the momentum to bfloat16, here the precision is that of the parameters.

    Args:
        params: Parameters to optimize.
        lr: Learning rate of both optimizers.
        weight_decay: Decoupled weight decay of both optimizers.
        momentum: Momentum of Muon.

    Example:
        >>> net = torch.nn.Linear(2, 2)
        >>> [len(group["params"]) for group in MuonAdamW(net.parameters(), lr=1e-2).param_groups]
        [1, 1]
    """

    def __init__(
        self, params: Iterable[Tensor], lr: float = 5e-3, weight_decay: float = 1e-4, momentum: float = 0.95
    ) -> None:
        params = list(params)
        matrices = [param for param in params if param.ndim == 2]
        others = [param for param in params if param.ndim != 2]
        common: dict[str, Any] = {"lr": lr, "weight_decay": weight_decay}
        self._parts: list[Optimizer] = []
        if matrices:
            self._parts.append(_Muon(matrices, momentum=momentum, adjust_lr_fn="match_rms_adamw", **common))
        if others:
            self._parts.append(AdamW(others, **common))
        super().__init__([group for part in self._parts for group in part.param_groups], {})
        self._share_state()

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        """Update all parameters once."""
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        for part in self._parts:
            part.step()
        return loss

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Restore the state of both optimizers."""
        super().load_state_dict(state_dict)
        self._share_state()

    def _share_state(self) -> None:
        """Have both optimizers work on the parameter groups and the state of this one."""
        for part, group in zip(self._parts, self.param_groups, strict=True):
            part.param_groups = [group]
            part.state = self.state


class _Muon(Muon):
    """Muon in the precision of the parameters.

    Without instructions for bfloat16, a processor needs twenty times as long for the products of matrices in that
    format, which was a fifth of a training step.
    """

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        """Update all parameters once."""
        loss = None if closure is None else torch.enable_grad()(closure)()
        for group in self.param_groups:
            for param in group["params"]:
                if param.grad is None:
                    continue
                state = self.state[param]
                if "momentum_buffer" not in state:
                    state["momentum_buffer"] = torch.zeros_like(param.grad)
                state["momentum_buffer"].lerp_(param.grad, 1 - group["momentum"])
                ahead = param.grad.lerp(state["momentum_buffer"], group["momentum"])  # Nesterov's
                update = _orthogonalize(ahead, group["ns_coefficients"], group["ns_steps"], group["eps"])
                param.mul_(1 - group["lr"] * group["weight_decay"])
                param.add_(update, alpha=-0.2 * max(param.shape) ** 0.5 * group["lr"])  # the scale of AdamW
        return loss


def _orthogonalize(matrix: Tensor, coefficients: tuple[float, float, float], num_steps: int, eps: float) -> Tensor:
    """Bring the singular values of a matrix near 1 by Newton-Schulz iterations."""
    a, b, c = coefficients
    wide = matrix.t() if matrix.size(0) > matrix.size(1) else matrix
    wide = wide / wide.norm().clamp(min=eps)
    for _ in range(num_steps):
        gram = wide @ wide.t()
        wide = torch.addmm(wide, torch.addmm(gram, gram, gram, beta=b, alpha=c), wide, beta=a)
    return wide.t() if matrix.size(0) > matrix.size(1) else wide
