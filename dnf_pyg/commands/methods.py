"""Methods that are measured on a test set, and running them behind a progress bar."""

import fnmatch
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from math import inf
from pathlib import Path

from tqdm import tqdm

from dnf_pyg.commands.evaluation_options import EvaluationOptions, MethodOptions
from dnf_pyg.commands.terminal import printable
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
    read_published,
    run_benchmark,
)
from dnf_pyg.pipeline import denoise
from dnf_pyg.weights.load import load_cascade
from dnf_pyg.weights.release import fingerprint

__all__ = [
    "check_titles",
    "matches",
    "methods_of",
    "network_method",
    "published_rows",
    "run_methods",
    "selected",
    "split_title",
]

Pair = tuple[Path, Path]


def split_title(word: str) -> tuple[str, str]:
    """Title and weights of ``[TITLE=]WEIGHTS``; the name of the file if no title is given.

    Example:
        >>> split_title("ours=runs/best.ckpt"), split_title("runs/best.ckpt")
        (('ours', 'runs/best.ckpt'), ('best', 'runs/best.ckpt'))
    """
    title, given, weights = word.rpartition("=")
    return (title if given else Path(weights).stem), weights


def network_method(title: str, weights: str, options: EvaluationOptions) -> NetworkMethod:
    """A network with the options of the command.

    Raises:
        WeightsError: If it cannot be loaded.
    """
    net = load_cascade(weights)
    filtering, update, num_passes = options.filtering, replace(options.update, max_excess=inf), options.num_passes
    denoiser = partial(denoise, weights=net, filtering=filtering, update=update, num_passes=num_passes)
    text = f"weights={fingerprint(net)}, filtering={filtering}, update={update}, num_passes={num_passes}"
    return NetworkMethod(title, denoiser, f"denoise({text})")


def methods_of(options: MethodOptions) -> list[Method]:
    """Networks and classical filters of the command.

    Raises:
        WeightsError: If a network cannot be loaded.
    """
    networks = [network_method(*split_title(word), options) for word in options.weights]
    update = options.update if options.filter_update == "shared" else None
    return [*networks, *(ClassicalMethod(name, BASELINES[name](), update) for name in options.baselines)]


def check_titles(methods: Sequence[Method], published: Sequence[Row] = ()) -> None:
    """Raise if two methods have the same title.

    Raises:
        DataError: If they do.
    """
    titles = [*(method.name for method in methods), *dict.fromkeys(row.method for row in published)]
    twice = sorted({title for title in titles if titles.count(title) > 1})
    if twice:
        raise DataError(f"Expected different titles (got two methods called '{twice[0]}'). Write TITLE=... for one.")


def published_rows(paths: Sequence[Path], pairs: Sequence[Pair]) -> list[Row]:
    """Results of other methods on these meshes.

    Raises:
        DataError: If a file cannot be read.
    """
    cases = {noisy.stem for noisy, _ in pairs}
    return [row for path in paths for row in read_published(path) if f"{row.mesh}_{row.noise}" in cases]


def selected(pairs: Sequence[Pair], options: EvaluationOptions) -> list[Pair]:
    """Pairs of meshes that the options ask for.

    Raises:
        DataError: If there is none.
    """
    wanted = options.meshes
    found = [(n, c) for n, c in pairs if wanted is None or matches(n.stem, wanted) or matches(c.stem, wanted)]
    if not found:
        raise DataError(f"Expected noisy meshes that match {wanted} (got none in '{options.data}'). Change --meshes.")
    return found[: options.limit]


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether a name matches any of the patterns."""
    return any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def run_methods(
    pairs: Sequence[Pair], methods: Sequence[Method], output: Path, store: Store | None = None
) -> tuple[list[Row], list[Failure]]:
    """Call :func:`~dnf_pyg.evaluate.benchmark.run_benchmark` behind a progress bar, with its log in a folder."""
    output.mkdir(parents=True, exist_ok=True)
    log = RowLog(output / "finished.jsonl")
    started = count()
    with tqdm(total=len(pairs) * len(methods), leave=False, disable=None) as bar:

        def progress(text: str) -> None:
            bar.set_description(printable(text), refresh=False)
            bar.update(next(started) - bar.n)

        return run_benchmark(pairs, methods, log, store=store, progress=progress)
