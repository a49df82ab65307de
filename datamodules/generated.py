"""Clean meshes made in code, to which noise is added: training without any download."""

from collections.abc import Sequence
from pathlib import Path

import torch
import trimesh
from tqdm import tqdm

from dnf_pyg.datamodules.clean_meshes import CleanMeshesDataModule
from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.io import write_mesh
from dnf_pyg.mesh.noise import Noise
from dnf_pyg.patches import PatchOptions
from dnf_pyg.synthetic.shapes import SHAPES

__all__ = ["GeneratedDataModule"]


class GeneratedDataModule(CleanMeshesDataModule):
    """Patches of random shapes (:data:`dnf_pyg.synthetic.shapes.SHAPES`) with noise added.

    The meshes are made once and kept in ``root/raw``.

    Args:
        root: Folder for the meshes and the prepared patches.
        kinds: Kinds of shapes; all if not given.
        num_meshes: Meshes of each kind.
        num_faces: Approximate number of faces of each mesh.
        noise: Noise model; :class:`~dnf_pyg.mesh.noise.GaussianNormalNoise` if not given.
        noise_level: Smallest and largest noise level, multiples of the mean edge length; each patch draws its own.
        patches: Number and size of the patches; its seed is that of the shapes too.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the meshes that are held back for validation and testing; 0 for none.
    """

    def __init__(
        self,
        root: str,
        kinds: Sequence[str] | None = None,
        num_meshes: int = 4,
        num_faces: int = 8000,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.05, 0.4),
        patches: PatchOptions = PatchOptions(),
        loader: LoaderOptions = LoaderOptions(),
        val_share: float = 0.1,
    ) -> None:
        numbers = range(patches.seed, patches.seed + num_meshes)
        names = [f"{kind}-{number}-{num_faces}" for kind in kinds or SHAPES for number in numbers]
        clean = str(Path(root) / "raw")
        super().__init__(clean, names, noise, noise_level, False, patches, loader, val_share, cache=root)

    def make_meshes(self) -> None:
        """Make the meshes that do not exist yet."""
        paths = [Path(self.root) / f"{name}.ply" for name in self.names or ()]
        missing = [path for path in paths if not path.is_file()]
        for path in tqdm(missing, "Making meshes", disable=not missing):
            path.parent.mkdir(parents=True, exist_ok=True)
            kind, number, num_faces = path.stem.rsplit("-", 2)
            pos, face = SHAPES[kind](torch.Generator().manual_seed(int(number)), int(num_faces))
            write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)
