"""Clean meshes of any folder, to which noise is added each time a patch is served."""

from collections.abc import Sequence
from functools import partial

from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.datasets.pairing import MeshPair, list_meshes, split_pairs
from dnf_pyg.mesh.noise import GaussianNormalNoise, Noise
from dnf_pyg.patches import PatchOptions

__all__ = ["CleanMeshesDataModule"]


class CleanMeshesDataModule(PatchDataModule):
    """Patches of clean meshes with noise added; that of the meshes held back is the same in every epoch.

    Args:
        root: Folder of clean meshes.
        names: File names without suffix; every mesh of the folder if not given.
        noise: Noise model; :class:`~dnf_pyg.mesh.noise.GaussianNormalNoise` if not given.
        noise_level: Smallest and largest noise level, multiples of the mean edge length; each patch draws its own.
        fresh: Cut the patches anew in every epoch, on the noisy surface
            (:class:`~dnf_pyg.datasets.FreshPatchDataset`), rather than once on the clean one.
        patches: Number and size of the patches.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the meshes that are held back for validation and testing; 0 for none.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all such meshes are named.
        cache: Folder for the prepared patches; ``root`` if not given.
    """

    def __init__(
        self,
        root: str,
        names: Sequence[str] | None = None,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.05, 0.4),
        fresh: bool = False,
        patches: PatchOptions = PatchOptions(),
        loader: LoaderOptions = LoaderOptions(),
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        cache: str | None = None,
    ) -> None:
        super().__init__(cache or root, patches, loader, val_share, broken)
        self.save_hyperparameters({"noise_level": list(noise_level)})  # weights tell what they were trained for
        self.root = root
        self.names = names
        self.make_dataset = partial(
            FreshPatchDataset if fresh else PatchDataset, noise=noise or GaussianNormalNoise(), noise_level=noise_level
        )

    def pairs(self, split: str) -> list[MeshPair]:
        """List the clean files of ``train``, or of the meshes that are held back."""
        clean = list_meshes(self.root, self.names)
        return split_pairs(self.sound([(None, path) for path in clean]), split, self.val_share)
