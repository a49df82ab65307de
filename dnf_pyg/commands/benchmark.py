"""Measure methods on a folder of test meshes."""

from collections.abc import Sequence
from pathlib import Path

from dnf_pyg.commands import methods
from dnf_pyg.commands.evaluation_options import BenchmarkOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.benchmark import Method, OutputFolder, Result, summary_table, write_results
from dnf_pyg.io import MeshFile, read_mesh, write_mesh
from dnf_pyg.view import draw_meshes

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
    rows, failures = methods.run_methods(pairs, compared, options.output, meshes)
    rows += published
    write_results(options.output, "/".join(folder.parts[-2:]), rows, failures, options.filtering.seed)
    for noisy, clean in pairs:
        meshes.draw(noisy, clean, [method.name for method in compared])
    tell(*summary_table(rows).splitlines())
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
