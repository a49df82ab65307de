"""Noisy and clean meshes of any folders, paired by name."""

from functools import partial

from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datamodules.refinement import Refinement
from dnf_pyg.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.datasets.pairing import MeshPair, find_pairs, split_pairs
from dnf_pyg.patches import PatchOptions

__all__ = ["PairsDataModule"]


class PairsDataModule(PatchDataModule):
    """Patches of noisy meshes whose clean versions have the same faces.

    Args:
        noisy: Folder of noisy meshes.
        clean: Folder of clean meshes.
        pattern: Regular expression that a noisy name (without suffix) matches; its first group is the clean name.
        refinement: Earlier networks of a cascade that the network of this training refines: patches are cut from what
            they make of the noisy meshes. The meshes as they are if not given.
        fresh: Cut the patches anew in every epoch (:class:`~dnf_pyg.datasets.FreshPatchDataset`).
        patches: Number and size of the patches.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the clean meshes that are held back for validation and testing, with all their noisy
            versions; 0 for none.
        broken: ``stop`` before training if a pair cannot be read or differs in its faces, or ``skip`` it; all such
            pairs are named.
        cache: Folder for the prepared patches; ``noisy`` if not given.
    """

    def __init__(
        self,
        noisy: str,
        clean: str,
        pattern: str = r"(.+)_(?:n\d+|noisy)",
        refinement: Refinement | None = None,
        fresh: bool = False,
        patches: PatchOptions = PatchOptions(),
        loader: LoaderOptions = LoaderOptions(),
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        cache: str | None = None,
    ) -> None:
        super().__init__(cache or noisy, patches, loader, val_share, broken)
        self.noisy = noisy
        self.clean = clean
        self.pattern = pattern
        self.make_dataset = partial(FreshPatchDataset if fresh else PatchDataset, refine=refinement)

    def pairs(self, split: str) -> list[MeshPair]:
        """List the noisy and clean files of ``train``, or of the meshes that are held back."""
        return split_pairs(self.sound(find_pairs(self.noisy, self.clean, self.pattern)), split, self.val_share)
