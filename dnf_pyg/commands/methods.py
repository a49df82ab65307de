"""What commands that compare methods share: options that name them, and running them behind a progress bar."""

import argparse
import fnmatch
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn

from dnf_pyg.commands.settings import DEFAULTS
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.evaluate.benchmark import (
    ClassicalMethod,
    Failure,
    Method,
    NetworkMethod,
    Row,
    RowLog,
    Store,
    VertexUpdate,
    run_benchmark,
)
from dnf_pyg.pipeline import denoise
from dnf_pyg.weights import DEFAULT_WEIGHTS, load_network, packaged_weights
from dnf_pyg.weights.release import fingerprint

__all__ = [
    "add_baselines",
    "add_selection",
    "add_settings",
    "add_weights",
    "check_titles",
    "classical_methods",
    "matches",
    "network_method",
    "run_methods",
    "selected",
    "split_title",
]

Pair = tuple[Path, Path]


def add_weights(parser: argparse.ArgumentParser) -> None:
    """Declare the networks to compare."""
    parser.add_argument(
        "--weights",
        nargs="*",
        default=[DEFAULT_WEIGHTS],
        metavar="[TITLE=]WEIGHTS",
        help="checkpoints, folders or packaged names "
        f"({', '.join(packaged_weights()) or 'none in this build'}); default {DEFAULT_WEIGHTS}",
    )


def add_baselines(parser: argparse.ArgumentParser, default: Sequence[str]) -> None:
    """Declare the classical filters to compare with."""
    parser.add_argument(
        "--baselines",
        nargs="*",
        choices=list(BASELINES),
        default=list(default),
        metavar="NAME",
        help=f"classical filters to run ({', '.join(BASELINES)}); {', '.join(default) or 'none'} by default, "
        "none if no name follows",
    )


def add_selection(parser: argparse.ArgumentParser) -> None:
    """Declare which meshes count."""
    parser.add_argument("--meshes", nargs="*", metavar="PATTERN", help="only these, such as 'block' or '*_n3'")
    parser.add_argument("--limit", type=int, metavar="N", help="only the first N noisy meshes")


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Declare what all methods are run with."""
    parser.add_argument(
        "--iterations",
        type=int,
        metavar="N",
        help=f"maximum number of iterations of the vertex update ({DEFAULTS['num_iterations']})",
    )
    parser.add_argument(
        "--filter-update",
        choices=["shared", "own"],
        default="shared",
        help="vertex update after a classical filter: that of the networks, as in the paper, or the filter's own, with "
        "a fixed number of iterations (%(default)s)",
    )
    parser.add_argument(
        "--repeat", type=int, default=1, help="filterings by a network, each of its own result (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the choice of patches (%(default)s)")


def split_title(word: str) -> tuple[str, str]:
    """Title and weights of ``[TITLE=]WEIGHTS``; the file's name where no title is given.

    Example:
        >>> split_title("ours=runs/best.ckpt"), split_title("runs/best.ckpt")
        (('ours', 'runs/best.ckpt'), ('best', 'runs/best.ckpt'))
    """
    title, given, weights = word.rpartition("=")
    return (title if given else Path(weights).stem), weights


def network_method(title: str, weights: str, options: argparse.Namespace) -> NetworkMethod:
    """A network with the options of :func:`add_settings`.

    Raises:
        WeightsError: If it cannot be loaded.
    """
    net = load_network(weights)
    settings = {**_update(options), "repeat": options.repeat, "seed": options.seed}
    text = "".join(f", {key}={value}" for key, value in settings.items())
    denoiser = partial(denoise, weights=net, **settings)
    return NetworkMethod(title, denoiser, f"denoise(weights={fingerprint(net)}{text})")


def classical_methods(options: argparse.Namespace) -> list[Method]:
    """The filters of :func:`add_baselines`."""
    update = None if options.filter_update == "own" else VertexUpdate(**_update(options))
    return [ClassicalMethod(name, BASELINES[name](), update) for name in options.baselines]


def _update(options: argparse.Namespace) -> dict[str, Any]:
    num_iterations = DEFAULTS["num_iterations"] if options.iterations is None else options.iterations
    return {"num_iterations": num_iterations, "max_correlation": DEFAULTS["max_correlation"]}


def check_titles(titles: Sequence[str]) -> None:
    """See that no title stands for two methods.

    Raises:
        DataError: If one does.
    """
    twice = sorted({title for title in titles if titles.count(title) > 1})
    if twice:
        raise DataError(f"Expected methods of different titles (got two called '{twice[0]}'): write TITLE=... for one")


def selected(pairs: Sequence[Pair], options: argparse.Namespace) -> list[Pair]:
    """Pairs that :func:`add_selection` asks for.

    Raises:
        DataError: If there is none.
    """
    wanted = options.meshes
    found = [(n, c) for n, c in pairs if wanted is None or matches(n.stem, wanted) or matches(c.stem, wanted)]
    if not found[: options.limit]:
        raise DataError(
            f"Expected noisy meshes that match {wanted} and --limit (got none in '{options.data}'): widen --meshes"
        )
    return found[: options.limit]


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether a name fits any of the patterns."""
    return any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def run_methods(
    pairs: Sequence[Pair], methods: Sequence[Method], log: RowLog, store: Store | None = None
) -> tuple[list[Row], list[Failure]]:
    """:func:`~dnf_pyg.evaluate.benchmark.run_benchmark` with a progress bar."""
    console = Console(stderr=True)
    with Progress(
        *Progress.get_default_columns(), MofNCompleteColumn(), TimeElapsedColumn(), console=console, transient=True
    ) as bar:
        task = bar.add_task("", total=len(pairs) * len(methods))
        started = -1

        def progress(text: str) -> None:
            nonlocal started
            started += 1
            bar.update(task, completed=started, description=text)

        return run_benchmark(pairs, methods, log, store=store, progress=progress)
