"""Write a checkpoint as a folder of weights to be released."""

from pathlib import Path
from typing import Any

from dnf_pyg.commands.options import ExportOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.commands.weights import release_lines
from dnf_pyg.errors import DataError, WeightsError
from dnf_pyg.evaluate.benchmark import read_results, summarize
from dnf_pyg.weights.load import load_cascade
from dnf_pyg.weights.release import fingerprint, write_release

__all__ = ["run"]


def run(options: ExportOptions) -> None:
    """Write a folder to be released, and print what it says about itself.

    Raises:
        WeightsError: If the checkpoint cannot be loaded, or the benchmark is not of these weights.
        DataError: If a file cannot be read.
    """
    net = load_cascade(options.checkpoint, options.data_set)
    benchmark = None if options.benchmark is None else _measured(options.benchmark, fingerprint(net))
    recipe = _text(options.recipe)
    release = write_release(
        options.output,
        net,
        description=options.description,
        licence=options.licence,
        sources=_text(options.sources),
        recipe=f"```yaml\n{recipe}```\n" if options.recipe.suffix in (".yaml", ".yml") else recipe,
        benchmark=benchmark,
    )
    tell(*release_lines(release))


def _measured(path: Path, weights: str) -> dict[str, Any]:
    """Means over the rows measured with the weights of this fingerprint."""
    results, data = read_results(path)
    rows = [row for row in results if f"weights={weights}," in row.parameters]
    if not rows:
        raise WeightsError(f"Expected results of the weights {weights} in '{path}' (got none). Benchmark them first.")
    return summarize([row for row in rows if row.method == rows[0].method], data)


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"Expected a text file (got '{path}': {error}). Check the path.") from error
