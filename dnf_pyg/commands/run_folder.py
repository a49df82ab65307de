"""Where a training run writes: one folder for all its loggers, and the same one when it goes on."""

import re
from collections.abc import Iterable
from itertools import count
from pathlib import Path
from typing import Any

from jsonargparse import Namespace
from lightning.pytorch.utilities import rank_zero_only

__all__ = ["keep_curve", "last_checkpoint", "number_loggers", "unnumbered_loggers"]


def unnumbered_loggers(loggers: Any) -> list[Namespace]:
    """Loggers that number the folders of their runs, each for itself, of the value of ``trainer.logger``."""
    return [
        logger
        for logger in (loggers if isinstance(loggers, list) else [loggers])
        if isinstance(logger, Namespace)
        and logger.class_path.endswith(("TensorBoardLogger", "CSVLogger"))
        and logger.init_args.version is None
    ]


def last_checkpoint(loggers: Iterable[Namespace]) -> Path | None:
    """The newest ``last.ckpt`` in the folders of all runs of these loggers."""
    found = [
        path for logger in loggers for run in _runs(logger).values() for path in run.glob("checkpoints/last*.ckpt")
    ]
    return max(found, key=lambda path: path.stat().st_mtime_ns, default=None)


def number_loggers(loggers: Iterable[Namespace], last: Path | None) -> None:
    """Have loggers of one name write into one folder.

    Args:
        loggers: Their configs, which get a ``version``.
        last: Checkpoint of the run that goes on; a new run if not given.
    """
    for logger in loggers:
        runs = _runs(logger)
        going_on = [number for number, run in runs.items() if last is not None and run in last.parents]
        logger.init_args.version = going_on[0] if going_on else max(runs, default=-1) + 1


@rank_zero_only
def keep_curve(folder: Path) -> None:
    """Put ``metrics.csv`` aside as ``metrics-1.csv`` and so on, since a logger that starts again deletes it."""
    path = folder / "metrics.csv"
    if path.is_file():
        path.rename(next(aside for n in count(1) if not (aside := folder / f"metrics-{n}.csv").exists()))


def _runs(logger: Namespace) -> dict[int, Path]:
    """Folders of the runs of a logger, by number."""
    folder = Path(logger.init_args.save_dir) / (logger.init_args.name or "")
    names = ((re.fullmatch(r"version_(\d+)", path.name), path) for path in sorted(folder.glob("version_*")))
    return {int(match[1]): path for match, path in names if match}
