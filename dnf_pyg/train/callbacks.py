"""Callback that denoises whole meshes during a training."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import torch
import trimesh
from lightning.pytorch import Callback, LightningModule, Trainer
from lightning.pytorch.utilities.seed import isolate_rng
from matplotlib.image import imread
from torch import Tensor

from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import read_mesh
from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.options import FilterOptions, UpdateOptions
from dnf_pyg.pipeline import denoise
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.view import draw_meshes

__all__ = ["MeshValidation"]


class _Case(NamedTuple):
    """A noisy mesh and its clean positions, (V, 3), with common faces, (3, F)."""

    noisy: Tensor
    clean: Tensor
    face: Tensor


class MeshValidation(Callback):
    """Denoise whole meshes during a training, log their theta and draw the error of their normals.

    Runs at the first validation of every n-th epoch, and with ``dnf-pyg validate``, on the weights that are validated
    (the averaged ones with ``EMAWeightAveraging``). Logs ``val/mesh_theta``, the mean over the meshes in degrees after
    the vertex update, and ``val/mesh_theta/NAME`` for each. Pictures go to every logger that accepts images, or else to
    ``mesh_errors/NAME-epoch=..-step=...png`` beside the checkpoints.

    The first process denoises and sends the results to the others, which wait. The random numbers of the training are
    left unchanged.

    Args:
        meshes: Pairs of a noisy and a clean file with the same faces, or clean files, which get the same Gaussian
            noise along the vertex normals every time.
        every_n_epochs: Number of epochs between two runs.
        noise_level: Level of the noise for clean files, multiples of the mean edge length.
        data_set: Name of the data set whose statistics of batch normalization are used, where a joint training keeps
            them apart.
        k: Neighbours per face on each level of the network; those of the data set or the network if not given.

    Raises:
        DataError: If no mesh is given; at the start of the run, if a file is missing or a pair does not match.
        ValueError: If ``every_n_epochs`` is not positive.
    """

    def __init__(
        self,
        meshes: Sequence[tuple[str, str] | str],
        every_n_epochs: int = 1,
        noise_level: float = 0.2,
        data_set: str | None = None,
        k: Sequence[int] | None = None,
    ) -> None:
        if not meshes:
            raise DataError(
                "Expected 'meshes' with at least one mesh (got none). Name some, or leave MeshValidation out."
            )
        if every_n_epochs < 1:
            raise ValueError(f"Expected 'every_n_epochs' of at least 1 (got {every_n_epochs}). Use 1 for every epoch.")
        pairs = [(None, item) if isinstance(item, str) else item for item in meshes]
        self.files = [(Path(noisy) if noisy else None, Path(clean)) for noisy, clean in pairs]
        self.every_n_epochs = every_n_epochs
        self.noise_level = noise_level
        self.data_set = data_set
        self.k = k
        self._cases: dict[str, _Case] = {}
        self._last_epoch = -1

    def setup(self, trainer: Trainer, pl_module: LightningModule, stage: str) -> None:
        """Read the meshes, so that a wrong file is reported before the training starts."""
        missing = [str(path) for pair in self.files for path in pair if path and not path.is_file()]
        if missing:
            raise DataError(
                f"Expected meshes to denoise while training (got no file {', '.join(missing)}). Check `meshes`."
            )
        self._cases = {(noisy or clean).stem: self._read(noisy, clean) for noisy, clean in self.files}

    def on_validation_batch_start(
        self, trainer: Trainer, pl_module: LightningModule, batch: Any, batch_idx: int, dataloader_idx: int = 0
    ) -> None:
        """Denoise before the first batch, when all callbacks have exchanged the weights for the validation."""
        epoch = trainer.current_epoch
        due = trainer.state.fn == "validate" or ((epoch + 1) % self.every_n_epochs == 0 and epoch != self._last_epoch)
        if trainer.sanity_checking or batch_idx or dataloader_idx or not due:
            return
        self._last_epoch = epoch
        theta: dict[str, float] = {}
        if trainer.is_global_zero:
            with isolate_rng():
                theta = self._denoise(trainer, pl_module)
        theta = trainer.strategy.broadcast(theta)  # all processes log them, so that each can be monitored
        values = {f"val/mesh_theta/{name}": value for name, value in theta.items()}
        values["val/mesh_theta"] = sum(theta.values()) / len(theta)
        pl_module.log_dict(values, on_step=False, on_epoch=True, batch_size=1)

    def state_dict(self) -> dict[str, Any]:
        """Epoch of the last run, so that a resumed training does not repeat it."""
        return {"last_epoch": self._last_epoch}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Restore the epoch of the last run."""
        self._last_epoch = state_dict["last_epoch"]

    def _denoise(self, trainer: Trainer, pl_module: LightningModule) -> dict[str, float]:
        """Denoise and draw each mesh; its theta in degrees.

        Runs in one process only, where a torchmetrics ``Metric`` would wait for the others.
        """
        net = cast("NormalFilteringModule", pl_module).network_for(self.data_set, self.k)
        found = {}
        for name, case in self._cases.items():
            mesh = trimesh.Trimesh(case.noisy.numpy(), case.face.t().numpy(), process=False)
            device, limits = FilterOptions(device=str(pl_module.device)), UpdateOptions(max_excess=float("inf"))
            result = denoise(mesh, net, filtering=device, update=limits)  # what the network does, right or wrong
            normals = (face_normals(pos, case.face) for pos in (result.pos, case.clean))
            found[name] = mean_angular_difference(*normals)
            picture = io.BytesIO()
            columns = {"noisy": case.noisy, f"denoised, epoch {trainer.current_epoch}": result.pos, "clean": case.clean}
            meshes = {title: (pos, case.face) for title, pos in columns.items()}
            draw_meshes(picture, meshes, meshes["clean"], size=320)
            self._show(trainer, name, picture.getvalue())
        return found

    def _read(self, noisy_path: Path | None, clean_path: Path) -> _Case:
        clean = read_mesh(clean_path)
        if noisy_path is None:
            generator = torch.Generator().manual_seed(0)
            noisy = GaussianNormalNoise()(clean.pos, clean.face, self.noise_level, generator)
            return _Case(noisy, clean.pos, clean.face)
        mesh = read_mesh(noisy_path)
        if not torch.equal(mesh.face, clean.face):
            raise DataError(
                f"Expected the same faces in the same order in '{noisy_path}' and '{clean_path}' (got others). Export "
                "both from the same mesh."
            )
        return _Case(mesh.pos, clean.pos, clean.face)

    def _show(self, trainer: Trainer, name: str, picture: bytes) -> None:
        """Send a picture to the loggers, or write it to a file if none accepts images."""
        boards: list[Any] = [getattr(logger, "experiment", None) for logger in trainer.loggers]
        boards = [board for board in boards if hasattr(board, "add_image")]
        for board in boards:
            pixels = imread(io.BytesIO(picture))[..., :3]
            board.add_image(f"mesh_errors/{name}", pixels, trainer.global_step, dataformats="HWC")
        if not boards:
            folder = Path(getattr(trainer.checkpoint_callback, "dirpath", None) or trainer.default_root_dir)
            path = folder / "mesh_errors" / f"{name}-epoch={trainer.current_epoch}-step={trainer.global_step}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, picture)
