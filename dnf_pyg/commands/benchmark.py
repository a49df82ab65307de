"""Denoise a folder of test meshes with several methods: tables (markdown, CSV, JSON) and plots of what comes out.

A run that was cut off goes on where it stood: launch it again with the same output folder. Rows are taken again for
other weights, settings or meshes; after a change of the code, use another folder.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from dnf_pyg.commands.methods import (
    add_baselines,
    add_selection,
    add_settings,
    add_weights,
    check_titles,
    classical_methods,
    matches,
    network_method,
    run_methods,
    selected,
    split_title,
)
from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.evaluate.benchmark import (
    Method,
    OutputFolder,
    Result,
    RowLog,
    read_published,
    summary_table,
    write_results,
)
from dnf_pyg.io import MeshFile, read_mesh, write_mesh
from dnf_pyg.view import draw_meshes

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "data", type=Path, metavar="DATA_ROOT", help="folder with original/NAME.obj and noisy/NAME_n1.obj, or above"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="folder for the results")
    add_weights(parser)
    add_baselines(parser, default=list(BASELINES))
    parser.add_argument(
        "--outputs",
        nargs="*",
        default=[],
        metavar="TITLE=FOLDER",
        help="meshes that other methods made, called as the noisy ones",
    )
    parser.add_argument(
        "--published",
        nargs="*",
        type=Path,
        default=[],
        metavar="CSV",
        help="theta of other methods: columns mesh, noise, method, theta_deg and, where there are, setting",
    )
    add_selection(parser)
    add_settings(parser)
    parser.add_argument(
        "--keep", nargs="*", default=[], metavar="PATTERN", help="write and draw the denoised meshes of these"
    )


def run(options: argparse.Namespace) -> None:
    """Denoise, measure, write all tables and plots, print the summary.

    Raises:
        DataError: If there are no meshes, two methods have one title, or, after everything else, a mesh failed.
    """
    folder = find_test_folder(options.data)
    pairs = selected(pair_meshes(folder), options)
    methods = _methods(options)
    published = [row for path in options.published for row in read_published(path)]
    check_titles([*(method.name for method in methods), *dict.fromkeys(row.method for row in published)])
    options.output.mkdir(parents=True, exist_ok=True)
    meshes = _MeshFolder(options.output, options.keep)
    rows, failures = run_methods(pairs, methods, RowLog(options.output / "finished.jsonl"), meshes)
    cases = {noisy.stem for noisy, _ in pairs}
    rows += [row for row in published if f"{row.mesh}_{row.noise}" in cases]
    write_results(options.output, "/".join(folder.parts[-2:]), rows, failures, options.seed)
    for noisy, clean in pairs:
        meshes.draw(noisy, clean, [method.name for method in methods])
    sys.stdout.write(summary_table(rows) + "\n")
    if failures:
        first = failures[0]
        raise DataError(
            f"{len(failures)} of {len(pairs) * len(methods)} results failed, all are named in "
            f"{options.output / 'results.md'}; the first is {first.method} on {first.noisy}: {first.reason}"
        )


def _methods(options: argparse.Namespace) -> list[Method]:
    methods: list[Method] = [network_method(*split_title(word), options) for word in options.weights]
    methods += classical_methods(options)
    for word in options.outputs:
        title, _, folder = word.partition("=")
        if not Path(folder).is_dir() or not folder:
            raise DataError(f"Expected TITLE=FOLDER for --outputs (got '{word}'): name a folder of meshes")
        methods.append(OutputFolder(title, Path(folder)))
    return methods


class _MeshFolder:
    """Denoised meshes that are kept, below the results: ``meshes/TITLE/NAME.obj``."""

    def __init__(self, folder: Path, patterns: Sequence[str]) -> None:
        self.folder, self.patterns = folder, patterns

    def path(self, noisy: str, method: str) -> Path:
        return self.folder / "meshes" / method.replace("/", "_") / f"{noisy}.obj"

    def has(self, noisy: str, method: Method) -> bool:
        return not matches(noisy, self.patterns) or self.path(noisy, method.name).is_file()

    def write(self, noisy: MeshFile, method: Method, result: Result) -> None:
        if matches(noisy.path.stem, self.patterns):
            path = self.path(noisy.path.stem, method.name)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_mesh(noisy, result.pos, path)

    def draw(self, noisy: Path, clean: Path, methods: Sequence[str]) -> None:
        """Draw the kept results on one mesh side by side, with their errors below."""
        paths = {method: self.path(noisy.stem, method) for method in methods}
        if not matches(noisy.stem, self.patterns):
            return
        files = {"clean": clean, "noisy": noisy, **{name: path for name, path in paths.items() if path.is_file()}}
        meshes = {name: (mesh.pos, mesh.face) for name, mesh in ((n, read_mesh(path)) for n, path in files.items())}
        draw_meshes(self.folder / f"{noisy.stem}.png", meshes, meshes["clean"])
