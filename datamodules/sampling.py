"""Samplers whose order and random numbers depend on seed and epoch only, the same on any number of processes."""

from collections.abc import Callable, Iterator

import torch
from torch.utils.data import Dataset, DistributedSampler
from torch_geometric.data import Data

__all__ = ["EpochSampler", "SeededItems", "ShareSampler"]


class EpochSampler(DistributedSampler):
    """Shuffle by seed and epoch, split the items among the processes, and start where a resumed run stopped.

    Yields pairs (epoch, item) for :class:`SeededItems`.

    Args:
        dataset: Data set to draw from.
        seed: Seed of the random order.
        progress: Returns the number of the epoch, and how many batches of it a resumed run has done; these are skipped
            the first time. A data set that is shorter than the epoch has been repeated.
        batch_size: Items of this process per batch.

    Example:
        >>> sampler = EpochSampler([0, 1, 2, 3, 4], seed=0, progress=lambda: (5, 4), batch_size=2)  # 3 batches a pass
        >>> len(list(sampler)), next(iter(sampler))[0]
        (3, 5)
    """

    def __init__(
        self, dataset: Dataset, seed: int, progress: Callable[[], tuple[int, int]], batch_size: int = 1
    ) -> None:
        super().__init__(dataset, *_processes(), shuffle=True, seed=seed)
        self.progress = progress
        self.batch_size = batch_size
        self.resuming = True

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of epoch and item."""
        epoch, done = self.progress()
        self.set_epoch(epoch)
        items = list(super().__iter__())
        batches = -(-len(items) // self.batch_size)
        start = done % batches * self.batch_size if self.resuming else 0
        self.resuming = False
        for item in items[start:]:
            yield epoch, item


class SeededItems(Dataset):
    """Items of a data set whose random parts depend on seed, epoch and item only.

    Args:
        dataset: Data set that draws noise, rotations and the like from the global generator of torch.
        seed: Seed of the random numbers.

    Example:
        >>> class Noise(Dataset):
        ...     def __getitem__(self, item):
        ...         return torch.rand(())
        >>> items = SeededItems(Noise(), seed=0)
        >>> bool(items[1, 2] == items[1, 2]), bool(items[1, 2] == items[2, 2])
        (True, False)
    """

    def __init__(self, dataset: Dataset, seed: int) -> None:
        self.dataset = dataset
        self.seed = seed

    def __len__(self) -> int:
        return len(self.dataset)  # type: ignore[arg-type]

    def __getitem__(self, place: tuple[int, int]) -> Data:
        """Serve one item of an epoch."""
        epoch, item = place
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed((self.seed * 1_000_003 + epoch) * 1_000_003 + item)
            return self.dataset[item]


class ShareSampler(DistributedSampler):
    """Split the items among the processes in order, without the padding that a metric would count twice.

    Args:
        dataset: Data set to draw from.

    Example:
        >>> list(ShareSampler([7, 8, 9]))
        [0, 1, 2]
    """

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset, *_processes(), shuffle=False)

    def __iter__(self) -> Iterator[int]:
        """Yield the items of this process."""
        return iter(range(self.rank, len(self.dataset), self.num_replicas))  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(range(self.rank, len(self.dataset), self.num_replicas))  # type: ignore[arg-type]


def _processes() -> tuple[int, int]:
    """Return the number of processes and the rank of this one."""
    distributed = torch.distributed
    if not (distributed.is_available() and distributed.is_initialized()):
        return 1, 0
    return distributed.get_world_size(), distributed.get_rank()
