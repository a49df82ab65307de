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
from dnf_pyg.commands.settings import DEFAULTS, add_settings, count, denoise_settings
from dnf_pyg.errors import DNFError, MeshFileError
from dnf_pyg.io import SUFFIXES, find_meshes, read_mesh, write_mesh
from dnf_pyg.io.atomic import check_writable
from dnf_pyg.io.selection import read_selection
from dnf_pyg.mesh.geodesic import DijkstraGrowth
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.pipeline import denoise
from dnf_pyg.view import draw_meshes, write_report
from dnf_pyg.weights.load import load_network

__all__ = ["add_arguments", "run"]


_ENDINGS = {"--picture": (".png",), "--report": (".html", ".htm")}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add = parser.add_argument
    add("input", type=_path, nargs="+", metavar="IN", help=f"noisy meshes ({', '.join(SUFFIXES)}), or folders of them")
    add("-o", "--output", type=_path, required=True, metavar="OUT",
        help="mesh to write, in the format of its ending; an existing folder for several inputs")  # fmt: skip
    add("--overwrite", action="store_true", help="replace outputs that exist (else an error; several inputs: left out)")
    result, running = add_settings(parser)
    result.add_argument("--mask", metavar="FILE_OR_PROPERTY", help="what may move: a .txt or .npy file with a number "
                        "per vertex or triangle, 0 stays; or such a property of a ply, glb or gltf mesh")  # fmt: skip
    running.add_argument("--device", default="cpu", help="cpu, cuda, cuda:1, mps (%(default)s)")
    running.add_argument("--threads", type=count, metavar="N", help="threads of the network (as many as cores)")
    add = parser.add_argument_group("what is shown").add_argument
    add("--reference", type=_path, metavar="CLEAN", help="clean mesh with the same faces: theta before and after")
    add("--picture", type=_path, metavar="PNG", help="both meshes side by side; with a reference, error maps")
    add("--report", type=_path, metavar="HTML", help="page with both meshes in 3D, histograms and figures")
    add("--json", action="store_true", help="print one JSON object per mesh")


def run(options: argparse.Namespace) -> None:
    """Denoise every input; one that fails does not stop the others.

    Raises:
        DNFError: If an input failed; the outputs of the others are written.
    """
    inputs = find_meshes(options.input)
    several = len(inputs) > 1 or any(path.is_dir() for path in options.input)
    if several and (options.reference or options.picture or options.report):
        raise MeshFileError("Expected one input with --reference, --picture and --report (got several)")
    to_folder = several or options.output.is_dir()
    outputs = {path: options.output / path.name if to_folder else options.output for path in inputs}
    if to_folder:
        check_writable(options.output / "result")
    same = [path for path, output in outputs.items() if several and path.resolve() == output.resolve()]
    if same and not options.overwrite:
        raise MeshFileError(
            f"Expected a folder for the results other than that of '{same[0]}' (got '{options.output}'): choose "
            "another, or add --overwrite to replace the inputs"
        )
    if options.threads is not None:
        torch.set_num_threads(options.threads)
    net = load_network(options.weights)
    _check_device(options.device)
    failed = []
    for number, (path, output) in enumerate(outputs.items(), start=1):
        if several and output.exists() and not options.overwrite:
            sys.stderr.write(f"{output}: already there, skipped\n")
            continue
        try:
            _run_one(path, output, net, options, f" ({number} of {len(inputs)})" if several else "")
        except BrokenPipeError:
            raise
        except Exception as error:  # bad input, or a fault of ours or too little memory at one of thousands of files
            if not several:
                raise
            sys.stderr.write(f"{path}: failed\n")
            failed.append(f"{path}: {error if isinstance(error, DNFError) else repr(error)}")
    if failed:
        raise DNFError(f"{len(failed)} of {len(inputs)} meshes failed: " + "; ".join(failed))


def _run_one(path: Path, output: Path, net: FilteringNetwork, options: argparse.Namespace, place: str) -> None:
    start = time.perf_counter()
    _check_outputs(output, options)
    mesh = read_mesh(path)
    reference = None if options.reference is None else read_reference(options.reference, mesh)
    settings = denoise_settings(options)
    mask = None if options.mask is None else read_selection(options.mask, mesh)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"filtering {path.name}{place}", total=None)
        result = denoise(
            mesh.mesh,
            net,
            mask=mask,
            device=options.device,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
            **settings,
        )
    write_mesh(mesh, result.pos, output)
    outcome = Outcome(mesh, result, output, time.perf_counter() - start, reference)
    values = outcome.values()
    sys.stdout.write(json.dumps(values) + "\n" if options.json else outcome_text(values))
    sys.stdout.flush()
    for warning in result.warnings:
        sys.stderr.write(f"warning: {f'{path}: ' if place else ''}{warning}\n")
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
            settings=_shown(options),
        )


def _check_outputs(output: Path, options: argparse.Namespace) -> None:
    """Raise before the long work if something could not be written, or would replace what is needed."""
    if output.suffix.lower() not in SUFFIXES:
        raise MeshFileError(
            f"Expected an output ending in {', '.join(SUFFIXES)} (got '{output}'): name a mesh, or an existing folder"
        )
    targets = {"-o": output, "--picture": options.picture, "--report": options.report}
    for option, target in targets.items():
        if target is None:
            continue
        if target.suffix.lower() not in _ENDINGS.get(option, SUFFIXES):
            raise MeshFileError(f"Expected a file ending in {_ENDINGS[option][0]} for {option} (got '{target}')")
        check_writable(target)
        if target.exists() and not options.overwrite:
            raise MeshFileError(f"Expected a new output file (got '{target}', which exists): add --overwrite")


def _shown(options: argparse.Namespace) -> dict[str, str]:
    """All settings, given or not, for the page."""
    given = {"growth": DijkstraGrowth(), "neighbors": "all"} | denoise_settings(options)
    given |= {name: getattr(options, name) for name in ("weights", "mask", "device")}
    named = {"None": "none", "inf": "none", "True": "yes", "False": "no"}
    values = {name: given.get(name, default) for name, default in DEFAULTS.items() if name not in ("mesh", "progress")}
    return {
        name.replace("_", " "): named.get(str(value), str(value).removeprefix("torch.").removesuffix("()"))
        for name, value in values.items()
    }


def _check_device(name: str) -> None:
    try:
        torch.zeros(1, device=name).cpu()
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise DNFError(f"Expected a device of this machine (got '{name}': {reason}): use cpu") from error


def _path(text: str) -> Path:
    """Path that is not empty, as an unset variable of a shell would be."""
    if not text:
        raise argparse.ArgumentTypeError("Expected a path (got an empty word)")
    return Path(text)
