"""Measure methods on a folder of test meshes."""

from collections.abc import Sequence
from pathlib import Path

import torch

import dnf_pyg
from dnf_pyg.commands import methods
from dnf_pyg.commands.evaluation_options import BenchmarkOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.benchmark import (
    Failure,
    Method,
    OutputFolder,
    Result,
    Row,
    draw_plots,
    markdown,
    summarize,
    write_csv,
    write_json,
)
from dnf_pyg.io import MeshFile, read_mesh, write_mesh
from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.view.report import draw_meshes

__all__ = ["run"]


def run(options: BenchmarkOptions) -> None:
    """Denoise, measure, write all tables and plots, print the summary.

    Raises:
        DataError: If there are no meshes, two methods have one title, or, after everything else, a mesh failed.
    """
    folder = find_test_folder(options.data)
    pairs = methods.selected(pair_meshes(folder), options)
    compared = [*methods.methods_of(options), *map(_output_folder, options.outputs)]
    published = methods.published_rows(options.published, pairs)
    methods.check_titles(compared, published)
    meshes = _MeshFolder(options.output, options.keep)
    rows, failures = methods.run_methods(pairs, compared, options.output, deliver=meshes.write, delivered=meshes.has)
    text = _write(options, "/".join(folder.parts[-2:]), [*rows, *published], failures)
    for noisy, clean in pairs:
        meshes.draw(noisy, clean, [method.name for method in compared])
    tell(*text.split("## Summary\n\n")[1].split("\n\n## ")[0].splitlines())
    if failures:
        first = failures[0]
        raise DataError(
            f"{len(failures)} of {len(pairs) * len(compared)} results failed, all are named in "
            f"{options.output / 'results.md'}. The first is {first.method} on {first.noisy}: {first.reason}"
        )


def _output_folder(word: str) -> OutputFolder:
    title, _, folder = word.partition("=")
    if not Path(folder).is_dir() or not folder:
        raise DataError(f"Expected TITLE=FOLDER for --outputs (got '{word}'). Name a folder of meshes.")
    return OutputFolder(title, Path(folder))


def _write(options: BenchmarkOptions, name: str, rows: Sequence[Row], failures: Sequence[Failure]) -> str:
    """Write tables and plots, and return the text of the markdown tables."""
    own = dict.fromkeys(row.method for row in rows if row.vertex_error is not None)
    facts = {
        "data": name,
        "seed": options.filtering.seed,
        "versions": {"dnf_pyg": dnf_pyg.__version__, "torch": torch.__version__},
        "num_threads": torch.get_num_threads(),
        "failures": [vars(failure) for failure in failures],
        "summary": {method: summarize([row for row in rows if row.method == method], name) for method in own},
    }
    text = markdown(f"Benchmark on {name}", rows, failures, torch.get_num_threads())
    write_bytes(options.output / "results.md", text.encode())
    write_json(options.output / "results.json", rows, facts)
    write_csv(options.output / "results.csv", rows)
    draw_plots(options.output, rows)
    return text


class _MeshFolder:
    """Denoised meshes that are kept beside the results: ``meshes/TITLE/NAME.obj``."""

    def __init__(self, folder: Path, patterns: Sequence[str]) -> None:
        self.folder, self.patterns = folder, patterns

    def path(self, noisy: str, method: str) -> Path:
        return self.folder / "meshes" / method.replace("/", "_") / f"{noisy}.obj"

    def has(self, noisy: str, method: Method) -> bool:
        return not methods.matches(noisy, self.patterns) or self.path(noisy, method.name).is_file()

    def write(self, noisy: MeshFile, method: Method, result: Result) -> None:
        if methods.matches(noisy.path.stem, self.patterns):
            path = self.path(noisy.path.stem, method.name)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_mesh(noisy, result.pos, path)

    def draw(self, noisy: Path, clean: Path, titles: Sequence[str]) -> None:
        """Draw the kept results on one mesh side by side, with their errors below."""
        paths = {method: self.path(noisy.stem, method) for method in titles}
        if not methods.matches(noisy.stem, self.patterns):
            return
        files = {"clean": clean, "noisy": noisy, **{name: path for name, path in paths.items() if path.is_file()}}
        meshes = {name: (mesh.pos, mesh.face) for name, mesh in ((n, read_mesh(path)) for n, path in files.items())}
        draw_meshes(self.folder / f"{noisy.stem}.png", meshes, meshes["clean"])
