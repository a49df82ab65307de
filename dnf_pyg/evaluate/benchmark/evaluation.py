"""Run methods over pairs of noisy and clean meshes and measure what they make."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
import trimesh

from dnf_pyg.errors import DNFError, MeshError
from dnf_pyg.evaluate.benchmark.methods import Method, OutputFolder, Result
from dnf_pyg.evaluate.benchmark.rows import Row, RowLog
from dnf_pyg.evaluate.metrics import MeanAngularDifference, VertexError
from dnf_pyg.io import MeshFile, read_mesh
from dnf_pyg.mesh.geometry import face_normals

__all__ = ["Failure", "run_benchmark"]

Pair = tuple[Path, Path]
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Failure:
    """A method that gave no result on a mesh.

    Attributes:
        noisy: Name of the noisy mesh.
        method: Name of the method.
        reason: What went wrong.
    """

    noisy: str
    method: str
    reason: str


def run_benchmark(
    pairs: Sequence[Pair],
    methods: Sequence[Method],
    log: RowLog,
    *,
    progress: Progress = lambda text: None,
    deliver: Callable[[MeshFile, Method, Result], None] | None = None,
    delivered: Callable[[str, Method], bool] = lambda noisy, method: True,
) -> tuple[list[Row], list[Failure]]:
    """Denoise every noisy mesh with every method and compare with the clean mesh.

    A row that the log holds already, for the same parameters and files, is taken from there. What fails is left out
    and told; the other meshes go on.

    Args:
        pairs: Noisy and clean file of each mesh; the noisy file's name starts with the clean one's.
        methods: What to compare, by different names.
        log: Where rows are looked up and added as soon as they are known.
        progress: Called with a short text before each method on each mesh, ``len(pairs) * len(methods)`` times.
        deliver: Called with each noisy mesh, method and result that was computed.
        delivered: Whether what ``deliver`` made of an earlier result is still there; if not, it is computed again.

    Returns:
        Rows and failures, in the order of ``pairs``, then ``methods``.

    Raises:
        ValueError: If two methods have one name.
    """
    names = [method.name for method in methods]
    if len(set(names)) < len(names):
        raise ValueError(f"Expected 'methods' of different names (got {names})")
    rows: list[Row] = []
    failures: list[Failure] = []
    warm: set[str] = set()
    for noisy_path, clean_path in pairs:
        name = noisy_path.stem
        case = None
        for method in methods:
            progress(f"{name}, {method.name}")
            try:
                parameters, data = method.parameters(name), _digest(noisy_path, clean_path)
                row = log.find(clean_path.stem, _noise(noisy_path, clean_path), method.name, parameters, data)
                if row is None or not delivered(name, method):
                    case = case or _Case.read(noisy_path, clean_path)
                    if method.name not in warm:
                        _warm_up(method)
                        warm.add(method.name)
                    result = method(name, case.noisy.pos, case.noisy.face)
                    row = case.measure(method.name, parameters, data, result)
                    log.add(row)
                    if deliver is not None:
                        deliver(case.noisy, method, result)
                rows.append(row)
            except (DNFError, OSError, RuntimeError, ArithmeticError, ValueError, LookupError, MemoryError) as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                failures.append(Failure(name, method.name, reason))
    return rows, failures


def _noise(noisy_path: Path, clean_path: Path) -> str:
    return noisy_path.stem.removeprefix(clean_path.stem).lstrip("_") or "noisy"


def _digest(*paths: Path) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _warm_up(method: Method) -> None:
    """Let the method compile and load what it needs, so that its first mesh takes no longer than the others."""
    if not isinstance(method, OutputFolder):
        sphere = trimesh.creation.icosphere(subdivisions=2)
        method("sphere", torch.tensor(sphere.vertices), torch.tensor(sphere.faces).t().contiguous())


class _Case:
    """A noisy mesh beside its clean one."""

    def __init__(self, noisy: MeshFile, clean: MeshFile) -> None:
        self.noisy, self.clean = noisy, clean
        self.clean_normal = face_normals(clean.pos, clean.face)
        self.theta_noisy = self._theta(face_normals(noisy.pos, noisy.face))

    @classmethod
    def read(cls, noisy_path: Path, clean_path: Path) -> "_Case":
        noisy, clean = read_mesh(noisy_path), read_mesh(clean_path)
        if noisy.face.shape != clean.face.shape:
            raise MeshError(
                f"Expected a noisy and a clean mesh with the same faces (got {noisy.face.size(1)} in '{noisy_path}', "
                f"{clean.face.size(1)} in '{clean_path}'): pair it with the mesh that it was made from"
            )
        return cls(noisy, clean)

    def measure(self, method: str, parameters: str, data: str, result: Result) -> Row:
        if not result.pos.isfinite().all():
            wrong = int((~result.pos.isfinite().all(dim=1)).sum())
            raise MeshError(f"Expected finite coordinates (got {wrong} vertices without, from {method}): leave it out")
        vertex_error = VertexError()
        vertex_error.update(result.pos, self.clean.pos, self.clean.face)
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
            vertex_error=float(vertex_error.compute()),
            seconds=result.seconds,
        )

    def _theta(self, normal: torch.Tensor) -> float:
        metric = MeanAngularDifference()
        metric.update(normal, self.clean_normal.to(normal.dtype))
        return float(metric.compute())
