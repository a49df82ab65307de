"""What a benchmark compares: networks, classical filters, and meshes that other programs made."""

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
from dnf_pyg.pipeline import DenoiseResult

__all__ = ["ClassicalMethod", "Method", "NetworkMethod", "OutputFolder", "Result"]


class Result(NamedTuple):
    """What a method made of one mesh.

    Attributes:
        pos: Denoised vertex positions, (V, 3).
        normal: Facet normals that the vertices were moved to fit, (F, 3), where known.
        seconds: Time it took, where known.
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
        """Everything that decides the result on the noisy mesh of that name, besides the mesh itself."""
        ...

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Denoise the mesh ``pos`` (V, 3), ``face`` (3, F), whose file is called ``noisy`` without its ending."""
        ...


@dataclass(frozen=True)
class NetworkMethod:
    """:func:`dnf_pyg.denoise` with one set of weights.

    Attributes:
        name: Title of the column.
        denoiser: The function with weights and settings filled in.
        settings: Text that tells these weights and settings from all others.
    """

    name: str
    denoiser: Callable[[trimesh.Trimesh], DenoiseResult]
    settings: str

    def parameters(self, noisy: str) -> str:
        """Weights and settings."""
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
    """

    name: str
    baseline: Baseline

    def parameters(self, noisy: str) -> str:
        """Class and parameters of the filter."""
        return repr(self.baseline)

    def __call__(self, noisy: str, pos: Tensor, face: Tensor) -> Result:
        """Denoise one mesh."""
        start = time.perf_counter()
        pos, normal = self.baseline(pos, face)
        return Result(pos, normal, time.perf_counter() - start)


@dataclass(frozen=True)
class OutputFolder:
    """Meshes that another program made, called as the noisy ones; their endings may differ.

    Attributes:
        name: Title of the column.
        folder: Where they lie.
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
                f"(got {len(mesh.pos)} and {mesh.face.size(1)}): write it without merging vertices"
            )
        return Result(mesh.pos, None, None)

    def _path(self, noisy: str) -> Path:
        paths = [self.folder / f"{noisy}{suffix}" for suffix in SUFFIXES]
        found = next((path for path in paths if path.is_file()), None)
        if found is None:
            raise MeshFileError(
                f"Expected a mesh called {noisy} in '{self.folder}' (got none ending in {', '.join(SUFFIXES)}): name "
                "it as the noisy mesh"
            )
        return found
