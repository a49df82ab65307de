"""Several data sets at once, each with its own neighbourhoods, weight and number of patches."""

from dataclasses import dataclass, field
from typing import Any, Literal

from lightning.pytorch import LightningDataModule
from lightning.pytorch.utilities import CombinedLoader
from torch_geometric.data import Batch

from dnf_pyg.datamodules.patches import PatchDataModule

__all__ = ["JointDataModule", "Part"]


@dataclass
class Part:
    """One data set of a joint training.

    Args:
        data: Its data module, which says how many patches, of how many faces, with how many neighbours K.
        levels: Nearest faces that each level of the network sees (k1, k2, k3), none above K or the network's own;
            the network's if not given.
        weight: Factor of its loss.
    """

    data: PatchDataModule
    levels: list[int] = field(default_factory=list)
    weight: float = 1.0


class JointDataModule(LightningDataModule):
    """Serve a batch of every data set in each step: a dictionary by name; the shorter ones start again.

    Each batch carries ``levels`` and ``weight`` for :class:`~dnf_pyg.train.module.NormalFilteringModule`, which logs
    the loss and theta of each data set under its name.

    Args:
        parts: Data sets by name.

    Raises:
        ValueError: If there is no part, or a level asks for more neighbours than its data set keeps.
    """

    def __init__(self, parts: dict[str, Part]) -> None:
        super().__init__()
        if not parts:
            raise ValueError("Expected 'parts' to name at least one data set (got none)")
        for name, part in parts.items():
            if part.levels and max(part.levels) > part.data.patches.k:
                raise ValueError(
                    f"Expected the 'levels' of '{name}' up to its k = {part.data.patches.k} (got {part.levels})"
                )
        self.parts = parts

    def prepare_data(self) -> None:
        """Prepare every data set."""
        for part in self._attached():
            part.data.prepare_data()

    def train_dataloader(self) -> CombinedLoader:
        """One batch of each data set a step, until the longest has ended."""
        return self._combined("train", "max_size_cycle")

    def val_dataloader(self) -> CombinedLoader:
        """All validation patches of each; ``None`` where one has ended."""
        return self._combined("val", "max_size")

    def test_dataloader(self) -> CombinedLoader:
        """All test patches of each; ``None`` where one has ended."""
        return self._combined("test", "max_size")

    def predict_dataloader(self) -> CombinedLoader:
        """All test patches of each."""
        return self._combined("predict", "max_size")

    def on_after_batch_transfer(self, batch: dict[str, Batch | None], dataloader_idx: int) -> dict[str, Batch]:
        """Give each batch its part's levels and weight; ended data sets are left out."""
        present: dict[str, Any] = {name: item for name, item in batch.items() if item is not None}
        for name, item in present.items():
            item.levels, item.weight = self.parts[name].levels, self.parts[name].weight
        return present

    def _combined(self, split: str, mode: Literal["max_size", "max_size_cycle"]) -> CombinedLoader:
        self._attached()
        loaders = {name: getattr(part.data, f"{split}_dataloader")() for name, part in self.parts.items()}
        return CombinedLoader(loaders, mode)

    def _attached(self) -> list[Part]:
        for part in self.parts.values():
            part.data.trainer = self.trainer
        return list(self.parts.values())
