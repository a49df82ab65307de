"""Clean meshes as a depth camera sees them: pairs of the Kinect kind, without Kinect data."""

from pathlib import Path

import torch
import trimesh
from rich.console import Console
from rich.progress import track
from torch.utils.data import Dataset

from dnf_pyg.datamodules.clean_meshes import list_meshes
from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.datasets.cache import name_entry
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh import Growth
from dnf_pyg.synthetic.depth_camera import DepthCamera, KinectV1
from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["DepthCameraDataModule"]


class DepthCameraDataModule(PatchDataModule):
    """Patches of what a virtual depth camera sees of clean meshes, from several sides.

    The views are made once and kept as pairs of meshes in ``cache/views``, in a folder for each mesh and camera: where
    either changes, they are made again.

    Args:
        root: Folder of clean meshes.
        cache: Folder for the views and the prepared patches.
        camera: The camera; a Kinect v1 at 1 metre by default.
        names: File names without ending that count; every mesh of the folder if not given.
        num_views: Views of each mesh, from random sides.
        num_patches: Patches per view.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        batch_size: Patches per batch.
        val_share: Share of the meshes held back for validation and testing, with all their views.
        broken: ``stop`` before training if a mesh cannot be read, or ``skip`` it; all of them are named.
        num_workers: Processes that load training patches.
        rotate: Turn every training patch by a random rotation.
        jitter: Jitter of the training normals.
        seed: Seed of the views, of the choice of patches and of their order.
    """

    def __init__(
        self,
        root: str,
        cache: str,
        camera: DepthCamera | None = None,
        names: list[str] | None = None,
        num_views: int = 4,
        num_patches: int = 200,
        patch_size: int = 800,
        k: int = 150,
        growth: Growth | None = None,
        batch_size: int = 10,
        val_share: float = 0.1,
        broken: OnBroken = "stop",
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.005,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth, broken)
        self.remember(locals(), "growth", "camera")
        self.camera = KinectV1() if camera is None else camera

    def prepare_data(self) -> None:
        """Take the pictures that are not there yet, then cut and cache the patches."""
        views = [(path, view) for path in self._files() for view in self._views(path)]
        missing = [(path, view) for path, view in views if not all(part.is_file() for part in view)]
        for path, view in track(missing, "Taking views", console=Console(stderr=True), disable=not missing):
            self._take(path, *view)
        super().prepare_data()

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, or of the held-back meshes."""
        pairs = self.share([(None, path) for path in self._files()], split)
        return self.patches([view for _, path in pairs for view in self._views(Path(path))], split)

    def _files(self) -> list[Path]:
        """Mesh files that can be read."""
        files = list_meshes(self.options.root, self.options.names)
        return [Path(path) for _, path in self.sound([(None, path) for path in files.values()])]

    def _views(self, path: Path) -> list[tuple[Path, Path]]:
        """Noisy and clean file of each view of a mesh."""
        options = self.options
        camera = {name: repr(value) for name, value in {"kind": type(self.camera), **vars(self.camera)}.items()}
        folder = Path(options.cache) / "views" / name_entry([path], camera)
        stems = [f"{path.stem}-{number}" for number in range(options.seed, options.seed + options.num_views)]
        return [(folder / f"{stem}_noisy.ply", folder / f"{stem}.ply") for stem in stems]

    def _take(self, path: Path, noisy: Path, clean: Path) -> None:
        noisy.parent.mkdir(parents=True, exist_ok=True)
        mesh, number = read_mesh(path), int(clean.stem.rsplit("-", 1)[1])
        generator = torch.Generator().manual_seed(number)
        view = self.camera(mesh.pos, mesh.face, Dice(generator).rotation(), generator)
        for target, pos in ((clean, view.clean), (noisy, view.noisy)):
            write_mesh(trimesh.Trimesh(pos.numpy(), view.face.t().numpy(), process=False), pos, target)
