"""Make the paper's tables and plots again from trained networks: markdown, PNG and CSV.

A run that was cut off goes on where it stood: launch it again with the same output folder.
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
    network_method,
    run_methods,
    selected,
    split_title,
)
from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.benchmark import Failure, RowLog, read_published
from dnf_pyg.evaluate.experiments import CASES, PAPER_MESHES, SERIES, write_ablation, write_scores, write_series

__all__ = ["add_arguments", "find_run", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    experiments = parser.add_subparsers(dest="experiment", metavar="EXPERIMENT", required=True)
    for name, summary in {
        "ablation": "Table 1: the network without each of its parts, beside the paper's figures",
        "scores": "scores of Eq. 4 of several methods, as a table and as the paper's plot",
        **{name: series.title.lower() for name, series in SERIES.items()},
    }.items():
        part = experiments.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        part.add_argument(
            "data", type=Path, metavar="DATA_ROOT", help="folder with original/NAME.obj and noisy/NAME_n1.obj, or above"
        )
        part.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="folder for the results")
        if name == "ablation":
            part.add_argument(
                "--runs", type=Path, default=Path("runs"), metavar="FOLDER",
                help="folder in which the configs ablation_*.yaml and synthetic.yaml have trained (%(default)s)",
            )  # fmt: skip
            part.add_argument(
                "--weights", nargs="*", default=[], metavar="CASE=WEIGHTS",
                help=f"weights of a case ({', '.join(CASES)}) in place of those in --runs",
            )  # fmt: skip
        else:
            add_weights(part)
            add_baselines(part, default=["BNF", "GNF"])
        if name == "scores":
            part.add_argument(
                "--published", nargs="*", type=Path, default=[], metavar="CSV",
                help="theta of other methods: columns mesh, noise, method, theta_deg",
            )  # fmt: skip
        if name in SERIES:
            choices = ", ".join(SERIES[name].settings)
            part.add_argument("--settings", nargs="*", metavar="SETTING", help=f"only these of {choices}")
        add_selection(part)
        add_settings(part)


def run(options: argparse.Namespace) -> None:
    """Run one experiment, write its files, print its table.

    Raises:
        DataError: If there are no meshes or no runs, two methods have one title, or, after everything else, a mesh
            failed.
    """
    folder = find_test_folder(options.data)
    if options.experiment == "ablation":
        text, failures = _ablation(folder, options)
    elif options.experiment == "scores":
        text, failures = _scores(folder, options)
    else:
        text, failures = _series(folder, options)
    sys.stdout.write(text + "\n")
    if failures:
        first = failures[0]
        raise DataError(
            f"{len(failures)} results failed, all are named in {options.output}; the first is {first.method} on "
            f"{first.noisy}: {first.reason}"
        )


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


def _ablation(folder: Path, options: argparse.Namespace) -> tuple[str, list[Failure]]:
    sources = {key: path for key, case in CASES.items() if (path := find_run(options.runs, case.runs))}
    for word in options.weights:
        case, weights = split_title(word)
        if case not in CASES or "=" not in word:
            raise DataError(f"Expected CASE=WEIGHTS with a case of {', '.join(CASES)} (got '{word}'): name one")
        sources[case] = Path(weights)
    if not sources:
        names = ", ".join(name for case in CASES.values() for name in case.runs)
        raise DataError(f"Expected runs called {names} in '{options.runs}' (got none): train them, or give --weights")
    of_paper = {mesh.lower() for mesh in PAPER_MESHES}
    pairs = [pair for pair in pair_meshes(folder) if pair[1].stem.lower() in of_paper]
    if not pairs:
        raise DataError(
            f"Expected some of the paper's meshes {', '.join(PAPER_MESHES)} in '{folder}' (got none): name the folder "
            "of the CNR benchmark"
        )
    pairs = selected(pairs, options)
    methods = [network_method(key, str(sources[key]), options) for key in CASES if key in sources]
    rows, failures = run_methods(pairs, methods, _log(options))
    return write_ablation(options.output, rows, failures, {k: str(v) for k, v in sources.items()}), failures


def _scores(folder: Path, options: argparse.Namespace) -> tuple[str, list[Failure]]:
    pairs = selected(pair_meshes(folder), options)
    published = [row for path in options.published for row in read_published(path)]
    methods = [network_method(*split_title(word), options) for word in options.weights] + classical_methods(options)
    check_titles([*(method.name for method in methods), *dict.fromkeys(row.method for row in published)])
    rows, failures = run_methods(pairs, methods, _log(options))
    cases = {noisy.stem for noisy, _ in pairs}
    rows += [row for row in published if f"{row.mesh}_{row.noise}" in cases]
    return write_scores(options.output, rows), failures


def _series(folder: Path, options: argparse.Namespace) -> tuple[str, list[Failure]]:
    series = SERIES[options.experiment]
    clean = list(dict.fromkeys(path for _, path in selected(pair_meshes(folder), options)))
    methods = [network_method(*split_title(word), options) for word in options.weights] + classical_methods(options)
    check_titles([method.name for method in methods])
    inputs = series.prepare(clean, options.settings or series.settings, options.output / "meshes")
    rows, failures = run_methods([(item.noisy, item.clean) for item in inputs], methods, _log(options))
    return write_series(options.output, options.experiment, series, inputs, rows, failures), failures


def _log(options: argparse.Namespace) -> RowLog:
    options.output.mkdir(parents=True, exist_ok=True)
    return RowLog(options.output / "finished.jsonl")
