"""Clean meshes as a depth camera sees them: pairs of the Kinect kind, without Kinect data."""

from pathlib import Path

import torch
import trimesh
from tqdm import tqdm

from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datasets.cache import name_entry
from dnf_pyg.datasets.pairing import MeshPair, list_meshes, split_pairs
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.patches import PatchOptions
from dnf_pyg.synthetic.depth_camera import DepthCamera, KinectV1
from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["DepthCameraDataModule"]


class DepthCameraDataModule(PatchDataModule):
    """Patches of what a virtual depth camera sees of clean meshes from random sides.

    The views are taken once and kept as pairs of meshes in ``cache/views``, in a folder for each mesh and camera:
    where either changes, they are taken again.

    Args:
        root: Folder of clean meshes.
        cache: Folder for the views and the prepared patches.
        camera: The camera; a :class:`~dnf_pyg.synthetic.depth_camera.KinectV1` if not given.
        names: File names without suffix; every mesh of the folder if not given.
        num_views: Views of each mesh.
        patches: Number and size of the patches of each view; its seed is that of the views too.
        loader: How the patches are batched, loaded and augmented.
        val_share: Share of the meshes that are held back for validation and testing, with all their views; 0 for
            none.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all such meshes are named.
    """

    def __init__(
        self,
        root: str,
        cache: str,
        camera: DepthCamera | None = None,
        names: list[str] | None = None,
        num_views: int = 4,
        patches: PatchOptions = PatchOptions(),
        loader: LoaderOptions = LoaderOptions(),
        val_share: float = 0.1,
        broken: OnBroken = "stop",
    ) -> None:
        super().__init__(cache, patches, loader, val_share, broken)
        self.root = root
        self.camera = camera or KinectV1()
        self.names = names
        self.num_views = num_views

    def pairs(self, split: str) -> list[MeshPair]:
        """List the noisy and clean views of the meshes of ``train``, or of those that are held back."""
        return [view for _, path in split_pairs(self._meshes(), split, self.val_share) for view in self.views(path)]

    def make_meshes(self) -> None:
        """Take the views that do not exist yet."""
        views = [(path, view) for _, path in self._meshes() for view in self.views(path)]
        missing = [(path, view) for path, view in views if not all(part.is_file() for part in view)]
        for path, view in tqdm(missing, "Taking views", disable=not missing):
            self._take(path, *view)

    def views(self, path: Path) -> list[tuple[Path, Path]]:
        """List the noisy and clean file of each view of a mesh."""
        camera = {name: repr(value) for name, value in {"kind": type(self.camera), **vars(self.camera)}.items()}
        folder = Path(self.cache) / "views" / name_entry([path], camera)
        stems = [f"{path.stem}-{number + self.patches.seed}" for number in range(self.num_views)]
        return [(folder / f"{stem}_noisy.ply", folder / f"{stem}.ply") for stem in stems]

    def _meshes(self) -> list[MeshPair]:
        return self.sound([(None, path) for path in list_meshes(self.root, self.names)])

    def _take(self, path: Path, noisy: Path, clean: Path) -> None:
        noisy.parent.mkdir(parents=True, exist_ok=True)
        mesh, number = read_mesh(path), int(clean.stem.rsplit("-", 1)[1])
        generator = torch.Generator().manual_seed(number)
        view = self.camera(mesh.pos, mesh.face, Dice(generator).rotation(), generator)
        for target, pos in ((clean, view.clean), (noisy, view.noisy)):
            write_mesh(trimesh.Trimesh(pos.numpy(), view.face.t().numpy(), process=False), pos, target)
