"""Clean meshes of any folder; the noise is drawn afresh each time a patch is served."""

from pathlib import Path

from torch.utils.data import Dataset

from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.errors import DataError
from dnf_pyg.io import SUFFIXES
from dnf_pyg.mesh import Growth
from dnf_pyg.mesh.noise import GaussianNormalNoise, Noise

__all__ = ["CleanMeshesDataModule", "list_meshes"]


def list_meshes(root: str | Path, names: list[str] | None = None) -> dict[str, Path]:
    """List the mesh files of a folder by name.

    Args:
        root: Folder.
        names: File names without ending that count; every mesh if not given.

    Raises:
        DataError: If the folder, a named mesh or any mesh is missing.
    """
    folder = Path(root)
    if not folder.is_dir():
        raise DataError(f"Expected a folder of clean meshes (got '{folder}', which does not exist): check `root`")
    files = {path.stem: path for path in sorted(folder.iterdir()) if path.suffix.lower() in SUFFIXES}
    names = list(files) if names is None else names
    absent = [name for name in names if name not in files]
    if absent or not names:
        raise DataError(
            f"Expected meshes ({', '.join(SUFFIXES)}) in '{folder}' (got none named {absent or 'anything'}): change "
            "`names`, or leave them out to take every mesh"
        )
    return {name: files[name] for name in names}


class CleanMeshesDataModule(PatchDataModule):
    """Patches of clean meshes with noise added; a share of the meshes is held back for validation and testing.

    Args:
        root: Folder of clean meshes.
        names: File names without ending that count; every mesh of the folder if not given.
        noise: Noise model; Gaussian along the vertex normal by default.
        noise_level: Smallest and largest level, multiples of the mean edge length; every patch draws its own.
        num_patches: Patches per mesh.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        fresh: Cut patches anew in every epoch, by Dijkstra's algorithm on the noisy surface, rather than once on the
            clean one (:class:`~dnf_pyg.datasets.FreshPatchDataset`).
        batch_size: Patches per batch.
        val_share: Share of the meshes held back; their noise is the same in every epoch.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all of them are named.
        cache: Folder for the prepared patches; ``root`` if not given.
        num_workers: Processes that load training patches.
        rotate: Turn every training patch by a random rotation.
        jitter: Jitter of the training normals.
        seed: Seed of the choice of patches and of the validation noise.
    """

    def __init__(
        self,
        root: str,
        names: list[str] | None = None,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.05, 0.4),
        num_patches: int = 300,
        patch_size: int = 800,
        k: int = 50,
        growth: Growth | None = None,
        fresh: bool = False,
        batch_size: int = 10,
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        cache: str | None = None,
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.0,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth, broken)
        self.remember(locals(), "growth", "noise")
        self.noise = GaussianNormalNoise() if noise is None else noise

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, or of the held-back meshes."""
        files = list_meshes(self.options.root, self.options.names)
        pairs = self.sound([(None, path) for path in files.values()])
        return self.patches(self.share(pairs, split), split, self.noise)
