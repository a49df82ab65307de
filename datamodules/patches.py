"""What the data modules share: loaders over patch data sets, one per split."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lightning.pytorch import LightningDataModule
from torch.utils.data import Dataset
from torch_geometric.data import Data
from torch_geometric.loader import DataLoader
from torch_geometric.transforms import Compose

from datamodules.sampling import EpochSampler, SeededItems, ShareSampler
from dnf_pyg.data import JitterNormal, PatchDataset, RandomRotation
from dnf_pyg.mesh import Growth
from dnf_pyg.mesh.noise import Noise

__all__ = ["PatchDataModule", "spread"]


def spread(names: list[str], share: float) -> set[str]:
    """Pick a share of the names, evenly spread over their order, at least one.

    Example:
        >>> sorted(spread(["a", "b", "c", "d"], 0.5))
        ['b', 'd']
    """
    count = max(1, round(share * len(names)))
    return {names[(2 * i + 1) * len(names) // (2 * count)] for i in range(count)}


class PatchDataModule(LightningDataModule):
    """Serve batches of patches; a subclass says which data set belongs to which split.

    Every batch is a PyG ``Batch`` with the attributes listed in :mod:`dnf_pyg.data.patch`.

    Args:
        batch_size: Patches per batch.
        num_workers: Processes that load training patches; 0 loads in the training process.
        rotate: Turn every training patch by a random rotation.
        jitter: Standard deviation of the jitter of the training normals, clipped at twice its value; 0 for none.
        growth: How patches grow; by Dijkstra's algorithm if not given.
    """

    def __init__(
        self, batch_size: int, num_workers: int, rotate: bool, jitter: float, growth: Growth | None = None
    ) -> None:
        super().__init__()
        self.growth = growth
        self.batch_size = batch_size
        self.num_workers = num_workers
        steps = ([RandomRotation()] if rotate else []) + ([JitterNormal(jitter, 2 * jitter)] if jitter else [])
        self.augmentation: Callable[[Data], Data] | None = Compose(steps) if steps else None

    def remember(self, arguments: dict[str, Any], *ignore: str) -> None:
        """Keep the arguments of ``__init__``, given as ``locals()``, as hyperparameters; objects are to be ignored.

        Plain ``save_hyperparameters()`` would take those of the outer module where a joint one is built from a file.
        """
        leave_out = {"self", "__class__", *ignore}
        self.save_hyperparameters({name: value for name, value in arguments.items() if name not in leave_out})

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, ``val`` or ``test``."""
        raise NotImplementedError

    def patches_with_noise(self, files: dict[str, Path], noise: Noise, split: str) -> PatchDataset:
        """Patches of clean meshes by name, with noise; ``val`` and ``test`` are the held-back share of them.

        Reads ``cache``, ``root``, ``val_share``, ``noise_level``, ``num_patches``, ``patch_size``, ``k`` and ``seed``
        from the hyperparameters. The noise of held-back meshes is the same in every epoch.
        """
        options = self.hparams
        held_back = spread(sorted(files), options.val_share)
        return PatchDataset(
            [(None, path) for name, path in files.items() if (name in held_back) == (split != "train")],
            options.get("cache") or options.root,
            num_patches=options.num_patches,
            patch_size=options.patch_size,
            k=options.k,
            growth=self.growth,
            noise=noise,
            noise_level=tuple(options.noise_level),
            noise_seed=None if split == "train" else options.seed,
            seed=options.seed,
            transform=self.augmentation if split == "train" else None,
        )

    def prepare_data(self) -> None:
        """Cut and cache the patches that the run needs, in one process; it sets no state."""
        splits = {"validate": ["val"], "test": ["test"], "predict": ["test"]}
        for split in splits.get(self.trainer.state.fn if self.trainer else "fit", ["train", "val"]):
            self.dataset(split)

    def train_dataloader(self) -> DataLoader:
        """Training patches, shuffled and augmented, in an order and with noise that seed and epoch decide."""
        seed = int(self.hparams.get("seed", 0))
        items = SeededItems(self.dataset("train"), seed)
        return DataLoader(
            items,
            self.batch_size,
            sampler=EpochSampler(items, seed, self._progress),
            num_workers=self.num_workers,
            persistent_workers=self.num_workers > 0,
        )

    def val_dataloader(self) -> DataLoader:
        """Validation patches."""
        return self._in_order("val")

    def test_dataloader(self) -> DataLoader:
        """Test patches."""
        return self._in_order("test")

    def predict_dataloader(self) -> DataLoader:
        """Test patches."""
        return self.test_dataloader()

    def _in_order(self, split: str) -> DataLoader:
        dataset = self.dataset(split)
        return DataLoader(dataset, self.batch_size, sampler=ShareSampler(dataset))

    def _progress(self) -> tuple[int, int]:
        """Epoch that begins, and items of it that a resumed run has seen already."""
        if self.trainer is None:
            return 0, 0
        epoch, batches = self.trainer.fit_loop.epoch_progress.current, self.trainer.fit_loop.epoch_loop.batch_progress
        if batches.current.ready and batches.is_last_batch:  # saved after the last batch of an epoch
            return max(epoch.processed, epoch.ready), 0
        return epoch.processed, batches.current.ready * self.batch_size
