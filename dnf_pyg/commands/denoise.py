"""Denoise meshes from file to file."""

import json
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from dnf_pyg.commands.compare import read_reference
from dnf_pyg.commands.options import DenoiseOptions
from dnf_pyg.commands.outcome import Outcome, outcome_text
from dnf_pyg.commands.outputs import check_output
from dnf_pyg.commands.terminal import printable, tell
from dnf_pyg.errors import DNFError, MeshFileError, OptionError
from dnf_pyg.io import find_meshes, read_mesh, write_mesh
from dnf_pyg.io.atomic import check_writable
from dnf_pyg.io.files import check_suffix
from dnf_pyg.io.selection import read_selection
from dnf_pyg.nn import Cascade
from dnf_pyg.nn.inference import inference_device
from dnf_pyg.pipeline import denoise
from dnf_pyg.progress import progress_bar
from dnf_pyg.weights.load import load_cascade

__all__ = ["check_device", "run"]


def run(options: DenoiseOptions) -> None:
    """Denoise every input; one that fails does not stop the others.

    Raises:
        DNFError: If an input failed; the outputs of the others are written.
    """
    outputs, several = _outputs(options)
    if options.threads is not None:
        torch.set_num_threads(options.threads)
    cascade = load_cascade(options.weights, options.data_set)
    check_device(options.filtering.device)
    failed, pages = [], {}
    for number, (path, output) in enumerate(outputs.items(), start=1):
        if several and output.exists() and not options.overwrite:
            tell(f"{output}: already there, skipped", file=sys.stderr)
            continue
        page = options.report if options.report is None or not several else options.report / f"{path.name}.html"
        try:
            place = f" ({number} of {len(outputs)})" if several else ""
            pages[path.name] = _run_one(path, output, page, cascade, options, place)
        except BrokenPipeError:
            raise
        except Exception as error:  # bad input, or a fault of ours or too little memory at one of thousands of files
            if not several:
                raise
            tell(f"{path}: failed", file=sys.stderr)
            failed.append(f"{path}: {error if isinstance(error, DNFError) else repr(error)}")
    if several and options.report is not None:
        from dnf_pyg.commands.showing import index_outcomes  # matplotlib takes a while to import

        index = options.report / "index.html"
        index_outcomes(index, pages)
        tell(f"{index}: page of {len(pages)} meshes")
    if failed:
        raise DNFError(f"{len(failed)} of {len(outputs)} meshes failed: " + "; ".join(failed))


def _outputs(options: DenoiseOptions) -> tuple[Mapping[Path, Path], bool]:
    """Output of each input, and whether there may be several.

    Raises:
        MeshFileError: If an input is missing, or the outputs would replace the inputs.
        OptionError: If several inputs are given with what is for one.
    """
    inputs = find_meshes(options.input)
    several = len(inputs) > 1 or any(path.is_dir() for path in options.input)
    if several and (options.reference or options.picture):
        raise OptionError(
            "Expected one input with --reference and --picture (got several). Denoise these meshes apart."
        )
    if several and options.report is not None:
        if not options.report.is_dir():
            raise OptionError(
                f"Expected a folder for --report of several inputs (got '{options.report}'). Name an existing folder."
            )
        check_writable(options.report / "index.html")
    if options.output is None:
        if several:
            raise OptionError("Expected -o FOLDER for several inputs (got none). Name an existing folder.")
        return {path: path.with_stem(f"{path.stem}_denoised") for path in inputs}, False
    to_folder = several or options.output.is_dir()
    outputs = {path: options.output / path.name if to_folder else options.output for path in inputs}
    if to_folder:
        check_writable(options.output / "result")
    same = [path for path, output in outputs.items() if several and path.resolve() == output.resolve()]
    if same and not options.overwrite:
        raise MeshFileError(
            f"Expected a folder for the results other than that of '{same[0]}' (got '{options.output}'). Choose "
            "another, or add --overwrite to replace the inputs."
        )
    return outputs, several


def _run_one(
    path: Path, output: Path, page: Path | None, cascade: Cascade, options: DenoiseOptions, place: str
) -> dict[str, Any]:
    start = time.perf_counter()
    check_suffix(path)  # where the output is named after the input, it is the input that is wrong
    check_output(output, overwrite=options.overwrite)
    for target, suffixes in ((options.picture, (".png",)), (page, (".html", ".htm"))):
        if target is not None:
            check_output(target, overwrite=options.overwrite, suffixes=suffixes)
    mesh = read_mesh(path)
    reference = None if options.reference is None else read_reference(options.reference, mesh)
    mask = None if options.mask is None else read_selection(options.mask, mesh)
    with progress_bar(printable(f"filtering {path.name}{place}"), "face") as report:
        result = denoise(
            mesh,
            cascade,
            filtering=options.filtering,
            update=options.update,
            num_passes=options.num_passes,
            mask=mask,
            progress=report,
        )
    write_mesh(mesh, result.pos, output)
    outcome = Outcome(mesh, result, output, time.perf_counter() - start, reference)
    values = outcome.values()
    tell(*([json.dumps(values)] if options.json else outcome_text(values)))
    for warning in result.warnings:
        tell(f"warning: {f'{path}: ' if place else ''}{warning}", file=sys.stderr)
    if options.picture is not None or page is not None:
        from dnf_pyg.commands.showing import show_outcome  # matplotlib takes a while to import

        show_outcome(outcome, values, options, page)
    return values


def check_device(name: str) -> None:
    """Make sure, before long work, that the network can run on a device.

    Raises:
        OptionError: If this machine has no such device.
    """
    try:
        torch.zeros(1, device=inference_device(name)).cpu()
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise OptionError(f"Expected a device of this machine (got '{name}': {reason}). Use cpu.") from error
