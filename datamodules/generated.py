"""Clean meshes made in code, noise drawn afresh: training without any download."""

from pathlib import Path

import torch
import trimesh
from rich.console import Console
from rich.progress import track
from torch.utils.data import Dataset

from dnf_pyg.datamodules.patches import PatchDataModule
from dnf_pyg.io import write_mesh
from dnf_pyg.mesh import Growth
from dnf_pyg.mesh.noise import GaussianNormalNoise, Noise
from dnf_pyg.synthetic.shapes import SHAPES

__all__ = ["GeneratedDataModule"]


class GeneratedDataModule(PatchDataModule):
    """Patches of random shapes (:data:`dnf_pyg.synthetic.shapes.SHAPES`) with noise added.

    The meshes are made once and kept in ``root/raw``.

    Args:
        root: Folder for the meshes and the prepared patches.
        kinds: Kinds of shapes; all if not given.
        num_meshes: Meshes of each kind.
        num_faces: About how many faces each has.
        noise: Noise model; Gaussian along the vertex normal by default.
        noise_level: Smallest and largest level, multiples of the mean edge length; every patch draws its own.
        num_patches: Patches per mesh.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        batch_size: Patches per batch.
        val_share: Share of the meshes held back; their noise is the same in every epoch.
        num_workers: Processes that load training patches.
        rotate: Turn every training patch by a random rotation.
        jitter: Jitter of the training normals.
        seed: Seed of the shapes, of the choice of patches and of the validation noise.
    """

    def __init__(
        self,
        root: str,
        kinds: list[str] | None = None,
        num_meshes: int = 4,
        num_faces: int = 8000,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.05, 0.4),
        num_patches: int = 100,
        patch_size: int = 800,
        k: int = 50,
        growth: Growth | None = None,
        batch_size: int = 10,
        val_share: float = 0.1,
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.0,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth)
        self.remember(locals(), "growth", "noise")
        self.noise = GaussianNormalNoise() if noise is None else noise

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, or of the held-back meshes."""
        pairs = [(None, path) for path in self._files().values()]
        return self.patches(self.share(pairs, split), split, self.noise)

    def prepare_data(self) -> None:
        """Make the meshes that are not there yet, then cut and cache the patches."""
        missing = [(name, path) for name, path in self._files().items() if not path.is_file()]
        for name, path in track(missing, "Making meshes", console=Console(stderr=True), disable=not missing):
            path.parent.mkdir(parents=True, exist_ok=True)
            kind, number, _ = name.rsplit("-", 2)
            generator = torch.Generator().manual_seed(int(number))
            pos, face = SHAPES[kind](generator, self.options.num_faces)
            write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)
        super().prepare_data()

    def _files(self) -> dict[str, Path]:
        """Mesh files by name, which tells all that shaped them."""
        options = self.options
        names = [
            f"{kind}-{number}-{options.num_faces}"
            for kind in options.kinds or SHAPES
            for number in range(options.seed, options.seed + options.num_meshes)
        ]
        return {name: Path(options.root) / "raw" / f"{name}.ply" for name in names}
