"""Run methods over pairs of noisy and clean meshes and measure their results."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import torch
import trimesh

from dnf_pyg.errors import DNFError, MeshError
from dnf_pyg.evaluate.benchmark.methods import Method, OutputFolder, Result
from dnf_pyg.evaluate.benchmark.rows import Failure, Row, RowLog
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.evaluate.metrics import VertexError
from dnf_pyg.io import MeshFile, read_mesh
from dnf_pyg.mesh.geometry import face_normals

__all__ = ["Store", "run_benchmark"]

Pair = tuple[Path, Path]


class Store(Protocol):
    """Keeps denoised meshes."""

    def has(self, noisy: str, method: Method) -> bool:
        """Whether nothing is missing here for a finished row; if not, its result is computed again."""
        ...

    def write(self, noisy: MeshFile, method: Method, result: Result) -> None:
        """Take a result that was just computed."""
        ...


def run_benchmark(
    pairs: Sequence[Pair],
    methods: Sequence[Method],
    log: RowLog,
    *,
    store: Store | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[list[Row], list[Failure]]:
    """Denoise every noisy mesh with every method and compare with the clean mesh.

    A row that the log holds already, for the same parameters and files, is taken from there. A method that fails on
    one mesh continues with the next.

    Args:
        pairs: Noisy and clean file of each mesh; the noisy file's name starts with the clean one's.
        methods: Methods to compare, with different names.
        log: Where rows are looked up and added as soon as they are known.
        store: Where denoised meshes are kept; nowhere by default.
        progress: Called with a short text before each method on each mesh, ``len(pairs) * len(methods)`` times.

    Returns:
        Rows and failures, in the order of ``pairs``, then ``methods``.

    Raises:
        ValueError: If two methods have one name.
    """
    names = [method.name for method in methods]
    if len(set(names)) < len(names):
        raise ValueError(f"Expected 'methods' of different names (got {names}). Rename one.")
    rows: list[Row] = []
    failures: list[Failure] = []
    warm: set[str] = set()
    for pair in pairs:
        name = pair[0].stem
        case = None
        for method in methods:
            progress(f"{name}, {method.name}")
            try:
                parameters, data = method.parameters(name), _digest(*pair)
                row = log.find(pair[1].stem, _noise(*pair), method.name, parameters, data)
                if row is None or (store is not None and not store.has(name, method)):
                    case = case or _Case(*pair)
                    if method.name not in warm:
                        _warm_up(method)
                        warm.add(method.name)
                    result = method(name, case.noisy.pos, case.noisy.face)
                    row = case.measure(method.name, parameters, data, result)
                    log.add(row)
                    if store is not None:
                        store.write(case.noisy, method, result)
                rows.append(row)
            except (DNFError, OSError, RuntimeError, ArithmeticError, ValueError, LookupError, MemoryError) as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                failures.append(Failure(name, method.name, reason))
    return rows, failures


def _noise(noisy: Path, clean: Path) -> str:
    return noisy.stem.removeprefix(clean.stem).lstrip("_") or "noisy"


def _digest(*paths: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:12]


def _warm_up(method: Method) -> None:
    """Let the method compile and load what it needs, so that its first mesh takes no longer than the others."""
    if not isinstance(method, OutputFolder):
        sphere = trimesh.creation.icosphere(subdivisions=2)
        method("sphere", torch.tensor(sphere.vertices), torch.tensor(sphere.faces).t().contiguous())


class _Case:
    """A noisy mesh and its clean one."""

    def __init__(self, noisy: Path, clean: Path) -> None:
        self.noisy, self.clean = read_mesh(noisy), read_mesh(clean)
        if self.noisy.face.shape != self.clean.face.shape:
            raise MeshError(
                f"Expected a noisy mesh with the {self.clean.face.size(1)} faces of '{clean}' (got "
                f"{self.noisy.face.size(1)} in '{noisy}'). Pair it with the mesh that it was made from."
            )
        self.clean_normal = face_normals(self.clean.pos, self.clean.face)
        self.theta_noisy = self._theta(face_normals(self.noisy.pos, self.noisy.face))

    def measure(self, method: str, parameters: str, data: str, result: Result) -> Row:
        if not result.pos.isfinite().all():
            wrong = int((~result.pos.isfinite().all(dim=1)).sum())
            raise MeshError(f"Expected finite coordinates (got {wrong} others from {method}). Leave this method out.")
        return Row(
            mesh=self.clean.path.stem,
            noise=_noise(self.noisy.path, self.clean.path),
            method=method,
            theta_deg=self._theta(face_normals(result.pos, self.noisy.face)),
            parameters=parameters,
            data=data,
            num_faces=self.noisy.face.size(1),
            theta_noisy_deg=self.theta_noisy,
            theta_normals_deg=None if result.normal is None else self._theta(result.normal),
            vertex_error=float(VertexError()(result.pos, self.clean.pos, self.clean.face)),
            seconds=result.seconds,
        )

    def _theta(self, normal: torch.Tensor) -> float:
        return mean_angular_difference(normal, self.clean_normal.to(normal.dtype))
