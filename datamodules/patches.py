"""The base of the data modules that serve patches: one data set and one loader per split."""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Literal

from lightning.pytorch import LightningDataModule
from lightning.pytorch.utilities import rank_zero_warn
from torch_geometric.data import Data
from torch_geometric.loader import DataLoader
from torch_geometric.transforms import Compose

from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.sampling import EpochSampler, SeededItems, ShareSampler
from dnf_pyg.datasets import MeshDataset, PatchDataset
from dnf_pyg.datasets.checks import find_faults
from dnf_pyg.datasets.pairing import MeshPair
from dnf_pyg.errors import DataError
from dnf_pyg.patches import PatchOptions
from dnf_pyg.transforms import JitterNormal, RandomRotation

__all__ = ["OnBroken", "PatchDataModule"]

OnBroken = Literal["stop", "skip"]
_SPLITS = {"validate": ["val"], "test": ["test"], "predict": ["test"]}


class PatchDataModule(LightningDataModule, ABC):
    """Serve batches of patches; subclasses implement :meth:`pairs`.

    Every batch is a PyG ``Batch`` with the attributes listed in :mod:`dnf_pyg.patches.patch`.

    Args:
        cache: Folder in which the prepared patches are kept.
        patches: Number and size of the patches.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the meshes that are held back for validation, with all their noisy versions; 0 for none.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all such meshes are named.
    """

    def __init__(
        self, cache: str, patches: PatchOptions, loader: LoaderOptions, val_share: float, broken: OnBroken
    ) -> None:
        super().__init__()
        self.cache = cache
        self.patches = patches
        self.loader = loader
        self.val_share = val_share
        self.broken = broken
        self.make_dataset: Callable[..., MeshDataset] = PatchDataset
        self._sound: dict[tuple[MeshPair, ...], list[MeshPair]] = {}

    @abstractmethod
    def pairs(self, split: str) -> list[MeshPair]:
        """List the noisy and clean files of ``train``, ``val`` or ``test``."""

    def make_meshes(self) -> None:
        """Make the meshes that do not exist yet."""

    def dataset(self, split: str) -> MeshDataset:
        """Prepare the patches of ``train``, ``val`` or ``test``; those of ``val`` and ``test`` never change."""
        seed = None if split == "train" else self.patches.seed
        return self.make_dataset(self.cache, self.pairs(split), self.patches, self.transform(split), noise_seed=seed)

    def transform(self, split: str) -> Callable[[Data], Data] | None:
        """Give the augmentation of ``train``; there is none for the other splits."""
        options, steps = self.loader, []
        if split == "train" and options.rotate:
            steps.append(RandomRotation())
        if split == "train" and options.jitter:
            steps.append(JitterNormal(options.jitter, 2 * options.jitter))
        return Compose(steps) if steps else None

    def sound(self, pairs: Sequence[MeshPair]) -> list[MeshPair]:
        """Leave out the pairs that cannot be trained on, or stop, as ``broken`` says.

        Raises:
            DataError: If there are such pairs and ``broken`` is ``stop``, or no other pair is left.
        """
        key = tuple(pairs)
        if key not in self._sound:
            self._sound[key] = self._checked(pairs)
        return self._sound[key]

    def check_neighbors(self, k: int) -> None:
        """Check that the patches keep as many neighbours as a network uses.

        Args:
            k: Neighbours of each face on the widest level of the network, the face itself included.

        Raises:
            DataError: If the patches keep fewer.
        """
        if k > self.patches.k:
            raise DataError(
                f"Expected 'patches.k' of at least {k}, the neighbours that the network uses (got {self.patches.k}). "
                "Raise `data.patches.k`, or lower `model.net.k`."
            )

    def prepare_data(self) -> None:
        """Make meshes and cut the patches that the run needs; one process does so for all.

        Raises:
            DataError: If the patches keep fewer neighbours than the network of the run uses.
        """
        stage: Any = "fit"
        if self.trainer is not None:
            stage = self.trainer.state.fn
            net: Any = getattr(self.trainer.lightning_module, "net", None)
            if getattr(self.trainer, "datamodule", None) is self and hasattr(net, "k"):
                self.check_neighbors(max(net.k))
        self.make_meshes()
        for split in _SPLITS.get(stage, ["train", "val"] if self.val_share else ["train"]):
            self.dataset(split)

    def train_dataloader(self) -> DataLoader:
        """Serve the training patches, augmented, in an order and with noise that depend on seed and epoch only."""
        warnings.filterwarnings("ignore", message="You're resuming from a checkpoint that ended before")  # it can
        items = SeededItems(self.dataset("train"), self.patches.seed)
        size, num_workers = self.loader.batch_size, self.loader.num_workers
        sampler = EpochSampler(items, self.patches.seed, self._progress, size)
        return DataLoader(
            items, batch_size=size, sampler=sampler, num_workers=num_workers, persistent_workers=num_workers > 0
        )

    def val_dataloader(self) -> DataLoader | list[DataLoader]:
        """Serve the validation patches; without any loader where no mesh is held back."""
        warnings.filterwarnings("ignore", message="Total length of `list` across ranks is zero")  # as asked for
        return self._in_order("val") if self.val_share else []

    def test_dataloader(self) -> DataLoader:
        """Serve the test patches."""
        return self._in_order("test")

    def predict_dataloader(self) -> DataLoader:
        """Serve the test patches."""
        return self.test_dataloader()

    def _in_order(self, split: str) -> DataLoader:
        dataset = self.dataset(split)
        sampler = ShareSampler(dataset)
        if len(dataset) < sampler.num_replicas:
            raise DataError(
                f"Expected at least one patch of '{split}' for every process (got {len(dataset)} patches for "
                f"{sampler.num_replicas} processes). Raise `patches.num_patches`, or use fewer processes."
            )
        return DataLoader(dataset, batch_size=self.loader.batch_size, sampler=sampler)

    def _checked(self, pairs: Sequence[MeshPair]) -> list[MeshPair]:
        faults = find_faults(pairs, self.cache)
        listed = "\n".join(
            f"  {' and '.join(repr(str(path)) for path in pair if path)}: {fault}" for pair, fault in faults.items()
        )
        left = [pair for pair in pairs if pair not in faults]
        if faults and (self.broken == "stop" or not left):
            raise DataError(
                f"Expected meshes that can be read, noisy and clean with the same faces in the same order (got "
                f"{len(faults)} others of {len(pairs)}):\n{listed}\n"
                "Repair or remove them, or leave them out with `broken: skip`."
            )
        if faults:
            rank_zero_warn(f"{len(faults)} of {len(pairs)} meshes are left out:\n{listed}")
        return left

    def _progress(self) -> tuple[int, int]:
        """Epoch that begins, and the batches of it that a resumed run has already done."""
        if self.trainer is None:
            return 0, 0
        epoch: Any = self.trainer.fit_loop.epoch_progress.current
        batches = self.trainer.fit_loop.epoch_loop.batch_progress
        if batches.current.ready and batches.is_last_batch:  # saved after the last batch of an epoch
            return max(epoch.processed, epoch.ready), 0
        return epoch.processed, batches.current.ready
