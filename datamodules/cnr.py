"""The CNR benchmark of Wang et al. 2016: four subsets of noisy and clean meshes."""

from pathlib import Path
from typing import Literal

from torch.utils.data import Dataset

from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datasets.pairing import pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.mesh import Growth

__all__ = ["CNRDataModule", "cnr_pairs"]

_SOURCE = (
    "The data come with Wang, Liu and Tong, 'Mesh Denoising via Cascaded Normal Regression', 2016, on the authors' "
    "project page; unpack them so that ROOT/SUBSET/{train,test}/{original,noisy} hold the meshes"
)


def cnr_pairs(root: str | Path, subset: str, split: str) -> list[tuple[Path, Path]]:
    """List noisy and clean files of one split (:func:`~dnf_pyg.datasets.pairing.pair_meshes`).

    Where the subset has a ``train_list.txt`` or ``test_list.txt``, only the names in it count.

    Args:
        root: Folder that holds the subsets.
        subset: Name of the subset.
        split: ``train`` or ``test``.

    Raises:
        DataError: If a folder is missing, holds no pair, or a listed mesh is not there.
    """
    folder = Path(root) / subset / split
    for part in (folder / "original", folder / "noisy"):
        if not part.is_dir():
            raise DataError(f"Expected the CNR benchmark (got no folder {part}). {_SOURCE}")
    listing = Path(root) / subset / f"{split}_list.txt"
    pairs = pair_meshes(folder)
    if not listing.is_file():
        return pairs
    names = {Path(line.strip()).stem for line in listing.read_text().splitlines() if line.strip()}
    absent = sorted(names - {clean.stem for _, clean in pairs})
    if absent:
        raise DataError(f"Expected every mesh of {listing} with noisy ones in {folder} (got none for {absent})")
    return [pair for pair in pairs if pair[1].stem in names]


class CNRDataModule(PatchDataModule):
    """Patches of one subset of the CNR benchmark.

    Source: Li et al. 2020, Sec. 3.5, for the numbers of patches and of faces.

    Args:
        root: Folder that holds the subsets.
        subset: ``Synthetic``, ``Kinect_v1``, ``Kinect_v2`` or ``Kinect_Fusion``.
        num_patches: Patches per noisy mesh; the paper's if not given: 100, or 200 of the Kinect subsets.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face; the paper's if not given: 50, or 150 of the Kinect subsets.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        batch_size: Patches per batch.
        val_share: Share of the training meshes held back for validation, with all their noisy versions.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all of them are named.
        cache: Folder for the prepared patches; beside the meshes, in ``root/processed``, if not given.
        num_workers: Processes that load training patches.
        rotate: Turn every training patch by a random rotation.
        jitter: Jitter of the training normals.
        seed: Seed of the choice of patches.
    """

    def __init__(
        self,
        root: str,
        subset: Literal["Synthetic", "Kinect_v1", "Kinect_v2", "Kinect_Fusion"] = "Synthetic",
        num_patches: int | None = None,
        patch_size: int = 800,
        k: int | None = None,
        growth: Growth | None = None,
        batch_size: int = 10,
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        cache: str | None = None,
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.005,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth, broken)
        synthetic = subset == "Synthetic"
        num_patches = (100 if synthetic else 200) if num_patches is None else num_patches
        k = (50 if synthetic else 150) if k is None else k
        self.remember(locals(), "growth", "synthetic")

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, ``val`` or ``test``."""
        options = self.options
        pairs = self.sound(cnr_pairs(options.root, options.subset, "test" if split == "test" else "train"))
        return self.patches(pairs if split == "test" else self.share(pairs, split), split)
