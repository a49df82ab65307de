"""Knowledge distillation: trained networks, one for each data set, teach a single one."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.errors import DataError
from dnf_pyg.train.losses import JointLoss, LossTerms
from dnf_pyg.weights.load import load_network

__all__ = ["Distillation"]


class Distillation:
    r"""Train the student to match the filtered normals of each data set's teacher.

    .. math::
        L = (1 - w) \, R(\mathbf{N}, \mathbf{N}^G) + w \, R(\mathbf{N}, \mathbf{N}^T)
            + \alpha \sum_u \|\Delta \mathbf{F}^u\|^2

    with the normal recovery :math:`R` of :class:`~dnf_pyg.train.losses.JointLoss` over all residual units of the
    student, the clean normals :math:`\mathbf{N}^G` and the output :math:`\mathbf{N}^T` of the teacher for the same
    noisy normals. Teachers are frozen, in evaluation mode, and not part of a checkpoint.

    Source: Li et al. 2020, Sec. 3.5, name the distillation of their two networks as future work; the loss is that of
    Hinton et al. 2015, "Distilling the knowledge in a neural network", for regression.

    Args:
        teachers: Weights of the teacher of each data set (see :func:`~dnf_pyg.weights.load_network`).
        weight: Share :math:`w` of the teachers, from 0 to 1.

    Raises:
        WeightsError: If a teacher cannot be loaded.
        ValueError: If there is no teacher, or ``weight`` is out of range.
    """

    def __init__(self, teachers: Mapping[str, str], weight: float = 0.5) -> None:
        if not teachers:
            raise ValueError("Expected 'teachers' with at least one teacher (got none). Name one for each data set.")
        if not 0 <= weight <= 1:
            raise ValueError(f"Expected 'weight' from 0 to 1 (got {weight}). Give the teachers' share of the loss.")
        self.weight = weight
        self.networks = {name: load_network(weights).requires_grad_(False) for name, weights in teachers.items()}

    def __deepcopy__(self, memo: dict[int, Any]) -> "Distillation":
        return self  # frozen, so copies of the student share them, such as the one with averaged weights

    def check(self, neighbors: Mapping[str, int]) -> None:
        """Check that every data set has a teacher and keeps the neighbours that it uses.

        Args:
            neighbors: Neighbours per face that each data set of the training keeps.

        Raises:
            DataError: If the names differ, or a teacher needs more neighbours than there are.
        """
        if set(neighbors) != set(self.networks):
            raise DataError(
                f"Expected a teacher for each data set of a joint training (got teachers for {sorted(self.networks)}, "
                f"data sets {sorted(neighbors)}). Use the same names in `distillation.teachers` and `data.parts`."
            )
        for name, net in self.networks.items():
            if max(net.k) > neighbors[name]:
                raise DataError(
                    f"Expected data set '{name}' with the {max(net.k)} neighbours that its teacher uses (got "
                    f"{neighbors[name]}). Raise its `patches.k`."
                )

    @torch.no_grad()
    def filtered(self, data_set: str, batch: Batch) -> Tensor:
        """Filter a batch of patches by the teacher of their data set; the normals, shape (F, 3)."""
        net = self.networks[data_set] = self.networks[data_set].to(batch.x.device)
        return net(**net.gather(batch))

    def __call__(
        self,
        terms: LossTerms,
        loss: JointLoss,
        stages: Sequence[tuple[Tensor, Tensor]],
        data_set: str,
        batch: Batch,
    ) -> LossTerms:
        """Add the teacher's share to the loss.

        Args:
            terms: Loss with the clean normals as the target.
            loss: Module that computed it.
            stages: Filtered normals (F, 3) and residual features (F, C) of the student's residual units.
            data_set: Name of the data set that the batch comes from.
            batch: Patches.
        """
        taught = loss(stages, self.filtered(data_set, batch), batch.batch).recovery
        more = self.weight * (taught - terms.recovery)
        return LossTerms(terms.total + more, terms.recovery + more, terms.residual)
