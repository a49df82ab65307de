"""What the data modules share: loaders over patch data sets, one per split."""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

from lightning.pytorch import LightningDataModule
from lightning.pytorch.utilities import rank_zero_warn
from torch.utils.data import Dataset
from torch_geometric.data import Data
from torch_geometric.loader import DataLoader
from torch_geometric.transforms import Compose

from dnf_pyg.datamodules.sampling import EpochSampler, SeededItems, ShareSampler
from dnf_pyg.datasets import FreshPatchDataset, MeshDataset, PatchDataset
from dnf_pyg.datasets.checks import find_faults
from dnf_pyg.datasets.mesh_dataset import MeshPair
from dnf_pyg.errors import DataError
from dnf_pyg.mesh import Growth
from dnf_pyg.mesh.noise import Noise
from dnf_pyg.transforms import JitterNormal, RandomRotation

__all__ = ["OnBroken", "PatchDataModule", "spread"]

OnBroken = Literal["stop", "skip"]


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

    Every batch is a PyG ``Batch`` with the attributes listed in :mod:`dnf_pyg.patches.patch`.

    Args:
        batch_size: Patches per batch.
        num_workers: Processes that load training patches; 0 loads in the training process.
        rotate: Turn every training patch by a random rotation.
        jitter: Standard deviation of the jitter of the training normals, clipped at twice its value; 0 for none.
        growth: How patches grow; by Dijkstra's algorithm if not given.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all of them are named.
    """

    def __init__(
        self,
        batch_size: int,
        num_workers: int,
        rotate: bool,
        jitter: float,
        growth: Growth | None = None,
        broken: OnBroken = "stop",
    ) -> None:
        super().__init__()
        self.broken = broken
        self._sound: dict[tuple[MeshPair, ...], list[MeshPair]] = {}
        self.growth = growth
        self.batch_size = batch_size
        self.num_workers = num_workers
        steps = ([RandomRotation()] if rotate else []) + ([JitterNormal(jitter, 2 * jitter)] if jitter else [])
        self.augmentation: Callable[[Data], Data] | None = Compose(steps) if steps else None

    @property
    def options(self) -> Any:
        """Arguments of ``__init__``, as attributes (Lightning leaves the type of ``hparams`` open)."""
        return self.hparams

    def remember(self, arguments: dict[str, Any], *ignore: str) -> None:
        """Keep the arguments of ``__init__``, given as ``locals()``, as hyperparameters; objects are to be ignored.

        Plain ``save_hyperparameters()`` would take those of the outer module where a joint one is built from a file.
        """
        leave_out = {"self", "__class__", *ignore}
        self.save_hyperparameters({name: value for name, value in arguments.items() if name not in leave_out})

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, ``val`` or ``test``."""
        raise NotImplementedError

    def sound(self, pairs: Sequence[MeshPair]) -> list[MeshPair]:
        """Leave out the pairs that cannot be trained on, or stop: as ``broken`` says.

        Raises:
            DataError: If there are such pairs and ``broken`` is ``stop``, or none is left; all of them are named.
        """
        key = tuple(pairs)
        if key not in self._sound:
            self._sound[key] = self._checked(pairs)
        return self._sound[key]

    def share(self, pairs: Sequence[MeshPair], split: str) -> list[MeshPair]:
        """Pairs of the held-back clean meshes, ``val_share`` of all by name; for ``train``, those of the others."""
        held_back = spread(sorted({Path(clean).stem for _, clean in pairs}), self.options.val_share)
        return [pair for pair in pairs if (Path(pair[1]).stem in held_back) == (split != "train")]

    def patches(self, pairs: Sequence[MeshPair], split: str, noise: Noise | None = None) -> MeshDataset:
        """Patches of all these pairs, augmented for ``train``; with noise, where it is given, on clean meshes alone.

        Reads ``num_patches``, ``patch_size``, ``k``, ``seed``, ``fresh`` if there is one and, for noise,
        ``noise_level`` from the hyperparameters. The noise of held-back meshes is the same in every epoch.
        """
        options = self.options
        drawn: dict[str, Any] = {}
        if noise is not None:
            drawn = {"noise": noise, "noise_level": tuple(options.noise_level)}
            drawn["noise_seed"] = None if split == "train" else options.seed
        common: dict[str, Any] = {
            "num_patches": options.num_patches,
            "patch_size": options.patch_size,
            "k": options.k,
            "transform": self.augmentation if split == "train" else None,
            **drawn,
        }
        if options.get("fresh"):
            return FreshPatchDataset(pairs, self._root(), **common)
        return PatchDataset(pairs, self._root(), growth=self.growth, seed=options.seed, **common)

    def prepare_data(self) -> None:
        """Cut and cache the patches that the run needs, in one process; it sets no state."""
        splits = {"validate": ["val"], "test": ["test"], "predict": ["test"]}
        stage: Any = self.trainer.state.fn if self.trainer else "fit"
        for split in splits.get(stage, ["train", "val"]):
            self.dataset(split)

    def train_dataloader(self) -> DataLoader:
        """Training patches, shuffled and augmented, in an order and with noise that seed and epoch decide."""
        warnings.filterwarnings("ignore", message="You're resuming from a checkpoint that ended before")  # it can
        seed = int(self.options.get("seed", 0))
        items = SeededItems(self.dataset("train"), seed)
        return DataLoader(
            items,
            self.batch_size,
            sampler=EpochSampler(items, seed, self._progress, self.batch_size),
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
        sampler = ShareSampler(dataset)
        if len(dataset) < sampler.num_replicas:  # type: ignore[arg-type]
            raise DataError(
                f"Expected a patch of '{split}' for every process at least (got {len(dataset)} patches for "  # type: ignore[arg-type]
                f"{sampler.num_replicas} processes): raise `num_patches` or use fewer processes"
            )
        return DataLoader(dataset, self.batch_size, sampler=sampler)

    def _root(self) -> str:
        """Folder for prepared patches."""
        return str(self.options.get("cache") or self.options.get("root") or self.options.noisy)

    def _checked(self, pairs: Sequence[MeshPair]) -> list[MeshPair]:
        faults = find_faults(pairs, self._root())
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
        """Epoch that begins, and batches of it that a resumed run has done already."""
        if self.trainer is None:
            return 0, 0
        epoch: Any = self.trainer.fit_loop.epoch_progress.current
        batches = self.trainer.fit_loop.epoch_loop.batch_progress
        if batches.current.ready and batches.is_last_batch:  # saved after the last batch of an epoch
            return max(epoch.processed, epoch.ready), 0
        return epoch.processed, batches.current.ready
