"""The CNR benchmark of Wang et al. 2016."""

from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datasets.cnr import PAPER_PATCHES, Subset
from dnf_pyg.datasets.pairing import MeshPair, cnr_pairs, split_pairs
from dnf_pyg.patches import PatchOptions

__all__ = ["CNRDataModule"]


class CNRDataModule(PatchDataModule):
    """Patches of one subset of the CNR benchmark (:class:`~dnf_pyg.datasets.CNR`).

    Args:
        root: Folder that holds the subsets.
        subset: ``Synthetic``, ``Kinect_v1``, ``Kinect_v2`` or ``Kinect_Fusion``.
        patches: Number and size of the patches; the paper's for the subset if not given.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the training meshes that are held back for validation, with all their noisy versions; 0
            for none.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all such meshes are named.
        cache: Folder for the prepared patches; ``root`` if not given.
    """

    def __init__(
        self,
        root: str,
        subset: Subset = "Synthetic",
        patches: PatchOptions | None = None,
        loader: LoaderOptions = LoaderOptions(),
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        cache: str | None = None,
    ) -> None:
        super().__init__(cache or root, patches or PAPER_PATCHES[subset], loader, val_share, broken)
        self.root = root
        self.subset = subset

    def pairs(self, split: str) -> list[MeshPair]:
        """List the noisy and clean files of ``train``, ``val`` or ``test``."""
        pairs = self.sound(cnr_pairs(self.root, self.subset, "test" if split == "test" else "train"))
        return pairs if split == "test" else split_pairs(pairs, split, self.val_share)
