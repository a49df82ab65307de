"""Settings of a training: fewer neighbours per face, and the part of each data set of a joint training."""

from collections.abc import Sequence
from dataclasses import dataclass

from torch import Tensor

from dnf_pyg.nn.thinning import random_ranks, select_ranks

__all__ = ["PartSettings", "Thinning"]


@dataclass(frozen=True)
class Thinning:
    """Train on a random choice of the neighbours, drawn anew in every step.

    Differs: the paper trains on all neighbours.

    Args:
        k: Neighbours kept per face on each level.
        num_steps: Steps after which all neighbours are kept, as in evaluation; never if not given.
    """

    k: list[int]
    num_steps: int | None = None

    def applies(self, step: int) -> bool:
        """Whether a training step is done on a choice of the neighbours."""
        return self.num_steps is None or step < self.num_steps

    def choose(self, edge_index: Tensor, edge_attr: Tensor, k: Sequence[int]) -> list[Tensor]:
        """Draw the edges of each level.

        Args:
            edge_index: Neighbour (row 0) to centre (row 1), in any order, shape (2, E).
            edge_attr: Rank of the neighbour among the nearest faces of its centre, shape (E,).
            k: Neighbours per face on each level to choose from.
        """
        ranks = [random_ranks(most, min(most, count)) for most, count in zip(k, self.k, strict=True)]
        return [select_ranks(edge_index, edge_attr, level) for level in ranks]


@dataclass(frozen=True)
class PartSettings:
    """How a joint training uses one of its data sets.

    Args:
        k: Neighbours per face on each level of the network; those of the network if not given.
        weight: Factor of the loss.
    """

    k: list[int] | None = None
    weight: float = 1.0
