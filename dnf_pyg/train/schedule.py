"""Learning rate schedule with warm-up, constant rate and decay."""

from typing import Any

from torch.optim import Optimizer
from torch.optim.lr_scheduler import LRScheduler

__all__ = ["WarmupStableDecay"]


class WarmupStableDecay(LRScheduler):
    """Raise the learning rate linearly, keep it constant, and lower it linearly to zero at the end.

    Without ``decay_start`` the rate stays constant, so a run of unknown length can be resumed, each time with the
    settings of its config: they are not restored from a checkpoint.
    Source: Hu et al. 2024, "MiniCPM", Sec. 4 (there with an exponential decay).

    Args:
        optimizer: Optimizer whose rate is scheduled.
        warmup_steps: Steps until the full rate is reached.
        decay_start: Step at which the rate begins to fall; never if not given.
        total_steps: Step at which the rate reaches zero; needed with ``decay_start``.

    Raises:
        ValueError: If ``warmup_steps`` is negative, ``total_steps`` is not after ``decay_start``, or only one of these
            is given.

    Example:
        >>> import torch
        >>> optimizer = torch.optim.SGD([torch.zeros(1)], lr=1.0)
        >>> schedule = WarmupStableDecay(optimizer, warmup_steps=2, decay_start=3, total_steps=5)
        >>> rates = []
        >>> for _ in range(6):
        ...     rates += schedule.get_last_lr()
        ...     optimizer.step()
        ...     schedule.step()
        >>> rates
        [0.5, 1.0, 1.0, 1.0, 0.5, 0.0]
    """

    def __init__(
        self,
        optimizer: Optimizer,
        warmup_steps: int = 0,
        decay_start: int | None = None,
        total_steps: int | None = None,
    ) -> None:
        if warmup_steps < 0:
            raise ValueError(f"Expected 'warmup_steps' of at least 0 (got {warmup_steps}). Use 0 for no warm-up.")
        if (decay_start is None) != (total_steps is None) or (decay_start or 0) >= (total_steps or 1):
            raise ValueError(
                f"Expected 'total_steps' after 'decay_start' (got {total_steps} and {decay_start}). Give both, or none."
            )
        self._settings = warmup_steps, decay_start, total_steps
        super().__init__(optimizer)

    def get_lr(self) -> list[float]:  # type: ignore[override]
        """Rate of each parameter group at the current step."""
        step = self.last_epoch
        warmup_steps, decay_start, total_steps = self._settings
        factor = min(1.0, (step + 1) / warmup_steps) if warmup_steps else 1.0
        if decay_start is not None and total_steps is not None and step > decay_start:
            factor = min(factor, max(0.0, (total_steps - step) / (total_steps - decay_start)))
        return [float(rate) * factor for rate in self.base_lrs]

    def state_dict(self) -> dict[str, Any]:
        """State without the settings."""
        return {name: value for name, value in super().state_dict().items() if name != "_settings"}
