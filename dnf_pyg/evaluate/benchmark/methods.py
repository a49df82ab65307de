"""Methods that a benchmark compares: networks, classical filters, and meshes that other programs made."""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

import torch
import trimesh
from torch import Tensor

from dnf_pyg.errors import MeshError, MeshFileError
from dnf_pyg.evaluate.baselines import Baseline
from dnf_pyg.io import SUFFIXES, read_mesh
from dnf_pyg.mesh.noise_level import estimate_noise
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.options import UpdateOptions
from dnf_pyg.pipeline import DenoiseResult

__all__ = ["ClassicalMethod", "Method", "NetworkMethod", "OutputFolder", "Result"]


class Result(NamedTuple):
    """Result of a method on one mesh.

    Attributes:
        pos: Denoised vertex positions, (V, 3).
        normal: Facet normals that the vertices were moved to fit, (F, 3), where known.
        seconds: Time that the method took, where known.
    """

    pos: Tensor
    normal: Tensor | None
    seconds: float | None


class Method(Protocol):
    """One column of the table."""

    @property
    def name(self) -> str:
        """Title of the column."""
        ...

    def parameters(self, noisy: str) -> str:
        """Everything besides the mesh itself that decides the result on the noisy mesh of this name."""
        ...

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Denoise the mesh ``pos`` (V, 3), ``face`` (3, F), whose file is called ``noisy`` without its ending."""
        ...


@dataclass(frozen=True)
class NetworkMethod:
    """:func:`dnf_pyg.denoise` with one set of weights.

    Attributes:
        name: Title of the column.
        denoiser: The function with weights and options bound.
        settings: Text that identifies these weights and options.
    """

    name: str
    denoiser: Callable[[trimesh.Trimesh], DenoiseResult]
    settings: str

    def parameters(self, noisy: str) -> str:
        """Weights and options."""
        return self.settings

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Denoise one mesh."""
        mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
        start = time.perf_counter()
        result = self.denoiser(mesh)
        seconds = time.perf_counter() - start
        return Result(torch.tensor(result.mesh.vertices, dtype=torch.float64), result.normal, seconds)


@dataclass(frozen=True)
class ClassicalMethod:
    """One of :mod:`dnf_pyg.evaluate.baselines`.

    Attributes:
        name: Title of the column.
        baseline: The filter with its parameters.
        update: Vertex update from the noisy mesh to the filtered normals, the same as for the networks: the paper
            compares methods this way (Li et al. 2020, Sec. 4). ``None`` keeps the filter's own vertex positions.
    """

    name: str
    baseline: Baseline
    update: UpdateOptions | None = UpdateOptions()

    def parameters(self, noisy: str) -> str:
        """Classes and parameters of the filter and of the update."""
        return repr(self.baseline) if self.update is None else f"{self.baseline!r}, {self.update!r}"

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Denoise one mesh."""
        start = time.perf_counter()
        moved, normal = self.baseline(pos, face)
        if self.update is not None:
            early = self.update.stops_early(estimate_noise(pos, face).is_correlated)
            moved = update_vertices(pos, face, normal, self.update.num_iterations, early_stopping=early)
        return Result(moved, normal, time.perf_counter() - start)


@dataclass(frozen=True)
class OutputFolder:
    """Meshes that another program made, under the names of the noisy ones; file formats may differ.

    Attributes:
        name: Title of the column.
        folder: Folder with the meshes.
    """

    name: str
    folder: Path

    def parameters(self, noisy: str) -> str:
        """Name and digest of the file.

        Raises:
            MeshFileError: If there is none.
        """
        path = self._path(noisy)
        return f"{path.name} sha256={hashlib.sha256(path.read_bytes()).hexdigest()[:12]}"

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Read one mesh.

        Raises:
            MeshError: If it has other faces than the noisy one.
        """
        mesh = read_mesh(self._path(noisy))
        if mesh.face.shape != face.shape or len(mesh.pos) != len(pos):
            raise MeshError(
                f"Expected {len(pos)} vertices and {face.size(1)} faces, those of the noisy mesh, in '{mesh.path}' "
                f"(got {len(mesh.pos)} and {mesh.face.size(1)}). Write it without merging vertices."
            )
        return Result(mesh.pos, None, None)

    def _path(self, noisy: str) -> Path:
        paths = [self.folder / f"{noisy}{suffix}" for suffix in SUFFIXES]
        found = next((path for path in paths if path.is_file()), None)
        if found is None:
            raise MeshFileError(
                f"Expected a mesh called '{noisy}' in '{self.folder}' (got none ending in {', '.join(SUFFIXES)}). Name "
                "it like the noisy mesh."
            )
        return found
