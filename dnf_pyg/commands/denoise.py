"""Denoise meshes: only vertex positions change, everything else of a file is kept."""

import argparse
import json
import sys
import time
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from dnf_pyg.commands.compare import read_reference
from dnf_pyg.commands.outcome import Outcome, outcome_figures, outcome_text
from dnf_pyg.denoise import denoise
from dnf_pyg.errors import DNFError, MeshFileError
from dnf_pyg.mesh.geodesic import DijkstraGrowth, Growth, HeatGrowth
from dnf_pyg.mesh.io import SUFFIXES, check_suffix, read_mesh, write_mesh
from dnf_pyg.mesh.selection import read_selection
from dnf_pyg.nn import DNFNet
from dnf_pyg.pretrained import DEFAULT_WEIGHTS, load_network, packaged_weights
from dnf_pyg.report import draw_meshes, write_report

__all__ = ["add_arguments", "run"]

_PRECISIONS = {"fp32": torch.float32, "bf16": torch.bfloat16}
_GROWTHS: dict[str, type[Growth]] = {"dijkstra": DijkstraGrowth, "heat": HeatGrowth}
_SETTINGS = (
    "weights strength max_move iterations repeat mask preserve_boundary "
    "growth patch_size coverage seed device precision"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    known = ", ".join(packaged_weights()) or "none in this build"
    add = parser.add_argument
    add("input", type=Path, nargs="+", metavar="IN", help=f"noisy meshes ({', '.join(SUFFIXES)}), or folders of them")
    add("-o", "--output", type=Path, required=True, metavar="OUT", help="mesh to write; a folder for several inputs")
    add("--overwrite", action="store_true", help="replace an existing output (else an error; skipped in a folder)")
    add(
        "--weights",
        default=DEFAULT_WEIGHTS,
        metavar="CHECKPOINT_OR_NAME",
        help=f"checkpoint of `dnf-pyg fit`, folder, or packaged name ({known}); default %(default)s",
    )
    result = parser.add_argument_group("result")
    add = result.add_argument
    add("--strength", type=_share, default=1.0, help="0 leaves the mesh as it is, 1 is full (%(default)s)")
    add("--max-move", type=_positive, default=float("inf"), metavar="L", help="limit, in mean edge lengths (none)")
    add("--iterations", type=_count, default=20, help="most iterations of the vertex update (%(default)s)")
    add("--repeat", type=_count, default=1, help="times that the network filters its own result (%(default)s)")
    add("--mask", metavar="FILE_OR_PROPERTY", help="what may move: a number per vertex or triangle, 0 stays")
    add("--preserve-boundary", action="store_true", help="leave open boundaries in place")
    add("--seed", type=int, default=0, help="seed of the choice of patches (%(default)s)")
    running = parser.add_argument_group("running")
    add = running.add_argument
    add("--patch-size", type=_count, default=800, metavar="N", help="faces per patch (%(default)s)")
    add("--growth", choices=_GROWTHS, default="dijkstra", help="geodesic distance that patches follow (%(default)s)")
    add("--coverage", type=_count, default=2, metavar="M", help="patches that every face lies in (%(default)s)")
    add("--device", default="cpu", help="cpu, cuda, cuda:1, mps (%(default)s)")
    add("--precision", choices=sorted(_PRECISIONS), default="fp32", help="of the network (%(default)s)")
    add("--threads", type=_count, metavar="N", help="threads of the network (as many as cores)")
    shown = parser.add_argument_group("what is shown")
    add = shown.add_argument
    add("--reference", type=Path, metavar="CLEAN", help="clean mesh: theta before and after")
    add("--picture", type=Path, metavar="PNG", help="noisy and denoised mesh side by side, with error maps")
    add("--report", type=Path, metavar="HTML", help="page with both meshes in 3D, histograms and figures")
    add("--json", action="store_true", help="print one JSON object per mesh")


def run(options: argparse.Namespace) -> None:
    """Denoise every input; one that fails does not stop the others.

    Raises:
        DNFError: If an input failed; the outputs of the others are written.
    """
    inputs = _inputs(options.input)
    to_folder = len(inputs) > 1 or any(path.is_dir() for path in options.input)
    if to_folder and (options.reference or options.picture or options.report or options.mask):
        raise MeshFileError("Expected one input with --reference, --picture, --report and --mask (got several)")
    if options.threads is not None:
        torch.set_num_threads(options.threads)
    net = load_network(options.weights)
    _check_device(options.device)
    failed = []
    for path in inputs:
        output = options.output / path.name if to_folder else options.output
        try:
            if to_folder and output.exists() and not options.overwrite:
                sys.stderr.write(f"{output}: already there, skipped\n")
                continue
            _run_one(path, output, net, options)
        except DNFError as error:
            if not to_folder:
                raise
            failed.append(f"{path}: {error}")
    if failed:
        raise DNFError(f"{len(failed)} of {len(inputs)} meshes failed: " + "; ".join(failed))


def _run_one(path: Path, output: Path, net: DNFNet, options: argparse.Namespace) -> None:
    start = time.perf_counter()
    check_suffix(output)
    for target in (output, options.picture, options.report):
        if target is not None and target.exists() and not options.overwrite:
            raise MeshFileError(f"Expected a new output file (got '{target}', which exists): add --overwrite")
        if target is not None and not target.absolute().parent.is_dir():
            raise MeshFileError(f"Expected an existing folder for '{target}' (got none): create it first")
    mesh = read_mesh(path)
    reference = None if options.reference is None else read_reference(options.reference, mesh)
    mask = None if options.mask is None else read_selection(options.mask, mesh)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"filtering {path.name}", total=None)
        result = denoise(
            mesh.mesh,
            net,
            strength=options.strength,
            max_move=options.max_move,
            num_iterations=options.iterations,
            repeat=options.repeat,
            mask=mask,
            preserve_boundary=options.preserve_boundary,
            growth=_GROWTHS[options.growth](),
            patch_size=options.patch_size,
            min_coverage=options.coverage,
            seed=options.seed,
            device=options.device,
            precision=_PRECISIONS[options.precision],
            progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    write_mesh(mesh, result.pos, output)
    outcome = Outcome(mesh, result, output, time.perf_counter() - start, reference)
    values = outcome.values()
    sys.stdout.write(json.dumps(values) + "\n" if options.json else outcome_text(values))
    for warning in result.warnings:
        sys.stderr.write(f"warning: {warning}\n")
    if options.picture is not None:
        meshes = {} if reference is None else {"clean": (reference.pos, mesh.face)}
        meshes |= {"noisy": (mesh.pos, mesh.face), "denoised": (result.pos, mesh.face)}
        draw_meshes(options.picture, meshes, meshes.get("clean"))
    if options.report is not None:
        write_report(
            options.report,
            mesh.pos,
            result.pos,
            mesh.face,
            title=f"{path.name}, denoised",
            subtitle=f"{mesh.face.size(1):,} triangles, {len(mesh.pos):,} vertices. " + " ".join(result.warnings),
            reference=None if reference is None else reference.pos,
            figures=outcome_figures(values),
            settings={name.replace("_", " "): _shown(getattr(options, name)) for name in _SETTINGS.split()},
        )


def _shown(value: object) -> str:
    return {"None": "none", "inf": "none", "True": "yes", "False": "no"}.get(str(value), str(value))


def _inputs(paths: list[Path]) -> list[Path]:
    """Mesh files, folders replaced by the meshes in them."""
    found = []
    for path in paths:
        inside = (
            [file for file in sorted(path.iterdir()) if file.suffix.lower() in SUFFIXES] if path.is_dir() else [path]
        )
        if not path.exists():
            raise MeshFileError(f"Expected a mesh file (got '{path}', which does not exist): check the path")
        if not inside:
            raise MeshFileError(f"Expected a folder with meshes (got '{path}' without any): give one that has some")
        found += inside
    names = [path.name for path in found]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise MeshFileError(f"Expected inputs of different names (got two of {sorted(twice)}): denoise them apart")
    return found


def _check_device(name: str) -> None:
    try:
        torch.zeros(1, device=name)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise DNFError(f"Expected a device of this machine (got '{name}': {reason}): use cpu") from error


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"Expected a number from 0 to 1 (got {text})")
    return value


def _positive(text: str) -> float:
    value = float(text)
    if not value >= 0:
        raise argparse.ArgumentTypeError(f"Expected a number of at least 0 (got {text})")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"Expected a number of at least 1 (got {text})")
    return value
