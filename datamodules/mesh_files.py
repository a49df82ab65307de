"""Mesh files to denoise, split among the processes."""

from collections.abc import Sequence
from pathlib import Path

from lightning.pytorch import LightningDataModule
from lightning.pytorch.utilities import rank_zero_info
from torch.utils.data import DataLoader

from dnf_pyg.errors import DataError
from dnf_pyg.io import find_meshes
from dnf_pyg.io.atomic import check_writable

__all__ = ["MeshFilesDataModule", "equal_shares"]


def equal_shares(sizes: Sequence[int], num_shares: int) -> list[list[int]]:
    """Split items into shares of nearly equal size: the largest item first, each into the smallest share.

    Args:
        sizes: Size of each item.
        num_shares: Number of shares.

    Returns:
        Rows of the items of each share, the largest item first.

    Example:
        >>> equal_shares([1, 5, 4, 2], num_shares=2)
        [[1, 0], [2, 3]]
    """
    shares: list[list[int]] = [[] for _ in range(num_shares)]
    filled = [0] * num_shares
    for item in sorted(range(len(sizes)), key=lambda item: -sizes[item]):
        smallest = filled.index(min(filled))
        shares[smallest].append(item)
        filled[smallest] += sizes[item]
    return shares


class MeshFilesDataModule(LightningDataModule):
    """Serve pairs of input and output paths to ``Trainer.predict``; each process gets a share of equal size.

    Args:
        inputs: Mesh files and folders of them.
        output: Folder for the results, which get the names of the inputs.
        overwrite: Denoise inputs again whose output exists.

    Raises:
        DataError: If the results would replace the inputs.
        OutputError: If the output is not writable.
        MeshFileError: For the inputs, see :func:`~dnf_pyg.io.files.find_meshes`.
    """

    def __init__(self, inputs: Sequence[str], output: str, overwrite: bool = False) -> None:
        super().__init__()
        self.overwrite = overwrite
        check_writable(Path(output) / "result")
        self._pairs = [(path, Path(output) / path.name) for path in find_meshes(Path(path) for path in inputs)]
        same = [str(source) for source, target in self._pairs if source.resolve() == target.resolve()]
        if same:
            raise DataError(f"Expected another folder for the results (got that of '{same[0]}'). Choose a new one.")

    @property
    def num_files(self) -> int:
        """Number of inputs, also of those whose output exists."""
        return len(self._pairs)

    def setup(self, stage: str) -> None:
        """Leave out inputs whose output exists, as the first process sees it, and keep the share of this process."""
        todo = [pair for pair in self._pairs if self.overwrite or not pair[1].exists()]
        if len(todo) < len(self._pairs):
            rank_zero_info(f"{len(self._pairs) - len(todo)} of {len(self._pairs)} outputs already there, skipped")
        rank, num_processes = 0, 1
        if self.trainer is not None:
            todo = self.trainer.strategy.broadcast(todo)
            rank, num_processes = self.trainer.global_rank, self.trainer.world_size
        sizes = [source.stat().st_size for source, _ in todo]
        self._share = [todo[item] for item in equal_shares(sizes, num_processes)[rank]]

    def predict_dataloader(self) -> DataLoader:
        """Serve pairs of input and output path, one at a time, the largest input first."""
        return DataLoader(self._share, batch_size=None, collate_fn=lambda pair: pair)
