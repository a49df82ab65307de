"""Random numbers, choices and rotations for the recipes of shapes, drawn from one generator."""

from collections.abc import Sequence
from typing import TypeVar

import torch
from torch import Generator, Tensor

__all__ = ["Dice"]

T = TypeVar("T")


class Dice:
    """Draws plain Python values from a generator.

    Args:
        generator: Source of the random numbers.
        places: States of the generator by name, to which it returns at :meth:`mark`.

    Example:
        >>> dice = Dice(torch.Generator().manual_seed(0))
        >>> 2 <= dice.uniform(2, 3) <= 3, dice.integer(4, 4), dice.choice("a")
        (True, 4, 'a')
    """

    def __init__(self, generator: Generator, places: dict[str, Tensor] | None = None) -> None:
        self.generator = generator
        self._places = {} if places is None else places

    def mark(self, name: str) -> Tensor:
        """State of the generator; if this place is kept, first return to it."""
        if name in self._places:
            self.generator.set_state(self._places.pop(name))
        return self.generator.get_state()

    def keep(self, name: str, state: Tensor) -> None:
        """Make other dice with the same places draw the same from here."""
        self._places[name] = state

    def uniform(self, low: float, high: float) -> float:
        """Draw a number between ``low`` and ``high``."""
        return low + (high - low) * torch.rand((), generator=self.generator, dtype=torch.float64).item()

    def integer(self, low: int, high: int) -> int:
        """Draw a whole number from ``low`` to ``high``, both included."""
        return int(torch.randint(low, high + 1, (), generator=self.generator))

    def chance(self, probability: float) -> bool:
        """Draw True with a probability."""
        return self.uniform(0, 1) < probability

    def choice(self, options: Sequence[T]) -> T:
        """Draw one of several values."""
        return options[self.integer(0, len(options) - 1)]

    def normal(self, *shape: int) -> Tensor:
        """Draw standard normal numbers, float64."""
        return torch.randn(*shape, generator=self.generator, dtype=torch.float64)

    def direction(self) -> Tensor:
        """Draw a unit vector (3)."""
        return torch.nn.functional.normalize(self.normal(3), dim=0)

    def rotation(self) -> Tensor:
        """Draw a rotation matrix (3, 3)."""
        turn, upper = torch.linalg.qr(self.normal(3, 3))
        turn = turn * upper.diagonal().sign()
        return turn * torch.linalg.det(turn)
