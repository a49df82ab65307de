"""The CNR benchmark of Wang et al. 2016: four subsets of noisy and clean meshes."""

import re
from pathlib import Path
from typing import Literal

from torch.utils.data import Dataset

from datamodules.patches import PatchDataModule, spread
from dnf_pyg.data import PatchDataset
from dnf_pyg.errors import DataError
from dnf_pyg.mesh import Growth

__all__ = ["CNRDataModule", "cnr_pairs"]

_SOURCE = (
    "The data come with Wang, Liu and Tong, 'Mesh Denoising via Cascaded Normal Regression', 2016, on the authors' "
    "project page; unpack them so that ROOT/SUBSET/{train,test}/{original,noisy} hold the meshes"
)


def cnr_pairs(root: str | Path, subset: str, split: str) -> list[tuple[Path, Path]]:
    """List noisy and clean files of one split, by name.

    A clean ``NAME.obj`` belongs to ``NAME_n1.obj``, ``NAME_n2.obj``, ... and ``NAME_noisy.obj``. Where the subset has
    a ``train_list.txt`` or ``test_list.txt``, only the names in it count.

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
    clean = {path.stem: path for path in sorted((folder / "original").glob("*.obj"))}
    listing = Path(root) / subset / f"{split}_list.txt"
    if listing.is_file():
        names = [Path(line.strip()).stem for line in listing.read_text().splitlines() if line.strip()]
        absent = sorted(set(names) - clean.keys())
        if absent:
            raise DataError(f"Expected every mesh of {listing} in {folder / 'original'} (got none for {absent})")
        clean = {name: clean[name] for name in names}
    noisy = sorted((folder / "noisy").glob("*.obj"))
    pairs = [
        (path, clean[match[1]])
        for path in noisy
        if (match := re.fullmatch(r"(.+)_(?:n\d+|noisy)", path.stem)) and match[1] in clean
    ]
    if not pairs:
        raise DataError(f"Expected pairs NAME.obj, NAME_n1.obj in {folder} (got none). {_SOURCE}")
    return pairs


class CNRDataModule(PatchDataModule):
    """Patches of one subset of the CNR benchmark.

    Args:
        root: Folder that holds the subsets.
        subset: ``Synthetic``, ``Kinect_v1``, ``Kinect_v2`` or ``Kinect_Fusion``.
        num_patches: Patches per noisy mesh.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        batch_size: Patches per batch.
        val_share: Share of the training meshes held back for validation, with all their noisy versions.
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
        num_patches: int = 100,
        patch_size: int = 800,
        k: int = 50,
        growth: Growth | None = None,
        batch_size: int = 10,
        val_share: float = 0.1,
        cache: str | None = None,
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.005,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth)
        self.remember(locals(), "growth")

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, ``val`` or ``test``."""
        options = self.hparams
        pairs = cnr_pairs(options.root, options.subset, "test" if split == "test" else "train")
        if split != "test":
            held_back = spread(sorted({clean.stem for _, clean in pairs}), options.val_share)
            pairs = [pair for pair in pairs if (pair[1].stem in held_back) == (split == "val")]
        return PatchDataset(
            pairs,
            options.cache or options.root,
            num_patches=options.num_patches,
            patch_size=options.patch_size,
            k=options.k,
            growth=self.growth,
            seed=options.seed,
            transform=self.augmentation if split == "train" else None,
        )
