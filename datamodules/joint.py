"""Several data sets at once, each with its own neighbourhoods, weight and number of patches."""

from typing import Literal

from lightning.pytorch import LightningDataModule
from lightning.pytorch.utilities import CombinedLoader
from torch_geometric.data import Batch

from dnf_pyg.datamodules.patches import PatchDataModule

__all__ = ["JointDataModule"]


class JointDataModule(LightningDataModule):
    """Serve a batch of every data set in each step: a dictionary by name; the shorter ones start again.

    :class:`~dnf_pyg.train.module.NormalFilteringModule` logs the loss and theta of each data set by its name; its
    argument ``parts`` says how many neighbours a data set uses and how much its loss weighs.

    Args:
        parts: Data modules by name.

    Raises:
        ValueError: If there is no part.
    """

    def __init__(self, parts: dict[str, PatchDataModule]) -> None:
        super().__init__()
        if not parts:
            raise ValueError("Expected 'parts' with at least one data set (got none). Name some.")
        self.parts = parts
        levels = {name: part.hparams.get("noise_level") for name, part in parts.items()}
        self.save_hyperparameters({"noise_level": levels})  # weights tell what they were trained for

    def prepare_data(self) -> None:
        """Prepare every data set."""
        for part in self._attached():
            part.prepare_data()

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
        """All test patches of each, one data set after the other, as Lightning asks for."""
        return self._combined("predict", "sequential")

    def on_after_batch_transfer(self, batch: dict[str, Batch | None] | Batch, dataloader_idx: int) -> dict[str, Batch]:
        """Leave out data sets that have ended; name the data set of a single batch."""
        if isinstance(batch, dict):
            return {name: item for name, item in batch.items() if item is not None}
        return {list(self.parts)[dataloader_idx]: batch}

    def _combined(self, split: str, mode: Literal["max_size", "max_size_cycle", "sequential"]) -> CombinedLoader:
        self._attached()
        loaders = {name: getattr(part, f"{split}_dataloader")() for name, part in self.parts.items()}
        return CombinedLoader(loaders, mode)

    def _attached(self) -> list[PatchDataModule]:
        for part in self.parts.values():
            part.trainer = self.trainer
        return list(self.parts.values())
