"""Make the tables and plots of the paper from trained networks: markdown, PNG and CSV.

An interrupted run continues when it is started again with the same output folder.
"""

from collections.abc import Sequence
from pathlib import Path

from dnf_pyg.commands import methods
from dnf_pyg.commands.evaluation_options import AblationOptions, EvaluationOptions, SeriesOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.benchmark import Failure
from dnf_pyg.evaluate.experiments import CASES, PAPER_MESHES, SERIES, write_ablation, write_series

__all__ = ["ablation", "find_run", "series"]


def find_run(runs: Path, names: Sequence[str]) -> Path | None:
    """The newest ``best*.ckpt`` below the first of the named runs that has one.

    Example:
        >>> find_run(Path("absent"), ["ablation_wo_reg"])
    """
    for name in names:
        found = sorted((runs / name).rglob("best*.ckpt"), key=lambda path: path.stat().st_mtime)
        if found:
            return found[-1]
    return None


def ablation(options: AblationOptions) -> None:
    """Table 1.

    Raises:
        DataError: If there are no meshes or no runs, or, after everything else, a mesh failed.
    """
    sources = {key: path for key, case in CASES.items() if (path := find_run(options.runs, case.runs))}
    for word in options.weights:
        case, weights = methods.split_title(word)
        if case not in CASES or "=" not in word:
            raise DataError(f"Expected CASE=WEIGHTS with a case of {', '.join(CASES)} (got '{word}'). Name one.")
        sources[case] = Path(weights)
    if not sources:
        names = ", ".join(name for case in CASES.values() for name in case.runs)
        raise DataError(f"Expected runs called {names} in '{options.runs}' (got none). Train them, or give --weights.")
    folder = find_test_folder(options.data)
    of_paper = {mesh.lower() for mesh in PAPER_MESHES}
    pairs = [pair for pair in pair_meshes(folder) if pair[1].stem.lower() in of_paper]
    if not pairs:
        raise DataError(
            f"Expected some of the paper's meshes {', '.join(PAPER_MESHES)} in '{folder}' (got none). Name the folder "
            "of the CNR benchmark."
        )
    pairs = methods.selected(pairs, options)
    networks = [methods.network_method(key, str(sources[key]), options) for key in CASES if key in sources]
    rows, failures = methods.run_methods(pairs, networks, options.output)
    text = write_ablation(options.output, rows, failures, {key: str(path) for key, path in sources.items()})
    _finish(text, failures, options)


def series(options: SeriesOptions) -> None:
    """Robustness to one property.

    Raises:
        DataError: If there are no meshes or no such settings, two methods have one title, or, after everything else, a
            mesh failed.
    """
    chosen = SERIES[options.series]
    pairs = methods.selected(pair_meshes(find_test_folder(options.data)), options)
    compared = methods.methods_of(options)
    methods.check_titles(compared)
    clean = list(dict.fromkeys(path for _, path in pairs))
    inputs = chosen.prepare(clean, options.settings or chosen.settings, options.output / "meshes")
    rows, failures = methods.run_methods([(item.noisy, item.clean) for item in inputs], compared, options.output)
    _finish(write_series(options.output, options.series, chosen, inputs, rows, failures), failures, options)


def _finish(text: str, failures: Sequence[Failure], options: EvaluationOptions) -> None:
    """Print the table, then raise if a mesh failed."""
    tell(*text.splitlines())
    if failures:
        first = failures[0]
        raise DataError(
            f"{len(failures)} results failed, all are named in {options.output}. The first is {first.method} on "
            f"{first.noisy}: {first.reason}"
        )
