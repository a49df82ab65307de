"""The CNR benchmark of Wang et al. 2016: four subsets of noisy and clean meshes."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from torch_geometric.data import Data

from dnf_pyg.datasets.pairing import cnr_pairs
from dnf_pyg.datasets.patch_dataset import PatchDataset
from dnf_pyg.patches.options import PatchOptions

__all__ = ["CNR", "PAPER_PATCHES", "Subset"]

Subset = Literal["Synthetic", "Kinect_v1", "Kinect_v2", "Kinect_Fusion"]

PAPER_PATCHES = {
    "Synthetic": PatchOptions(num_patches=100, patch_size=800, k=50),
    "Kinect_v1": PatchOptions(num_patches=200, patch_size=800, k=150),
    "Kinect_v2": PatchOptions(num_patches=200, patch_size=800, k=150),
    "Kinect_Fusion": PatchOptions(num_patches=200, patch_size=800, k=150),
}
"""Patches of each subset, as in Li et al. 2020, Sec. 3.5."""


class CNR(PatchDataset):
    """Patches of one split of the CNR benchmark, with the clean facet normals as targets.

    The meshes lie in ``root/SUBSET/{train,test}/{original,noisy}``, as the authors publish them.

    Source: Wang, Liu and Tong, "Mesh Denoising via Cascaded Normal Regression", TOG 2016.

    Args:
        root: Folder that holds the subsets.
        subset: ``Synthetic``, ``Kinect_v1``, ``Kinect_v2`` or ``Kinect_Fusion``.
        split: ``train`` or ``test``.
        transform: Applied to each patch when it is served.
        patches: Number and size of the patches; the paper's for the subset if not given.
        cache: Folder in which ``processed`` is written; ``root`` if not given.

    Raises:
        DataError: If the meshes are missing, or a noisy mesh does not have the faces of its clean one.
    """

    def __init__(
        self,
        root: str | Path,
        subset: Subset = "Synthetic",
        split: Literal["train", "test"] = "train",
        transform: Callable[[Data], Data] | None = None,
        patches: PatchOptions | None = None,
        cache: str | Path | None = None,
    ) -> None:
        self.subset = subset
        self.split = split
        super().__init__(cache or root, cnr_pairs(root, subset, split), patches or PAPER_PATCHES[subset], transform)
