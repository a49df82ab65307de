"""Progress and time of long work."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

__all__ = ["Progress", "Stopwatch", "part_of", "progress_bar"]

Progress = Callable[[int, int], None]
"""Function that is called with the amount of work done and the total amount."""


_LINE_SECONDS = 10.0  # between lines of progress


@contextmanager
def progress_bar(description: str, unit: str, *, hidden: bool | None = None) -> Iterator[Progress]:
    """Show a progress bar on stderr, and remove it at the end; in a file, write a line every ten seconds.

    Args:
        description: Text before the bar.
        unit: Unit of the work, such as ``face``.
        hidden: Show nothing; if not given, a bar in a terminal and lines elsewhere.

    Yields:
        The function that moves the bar.
    """
    if hidden is None and not sys.stderr.isatty():
        yield _lines(description, unit)
        return
    with tqdm(desc=description, unit=unit, leave=False, disable=hidden) as bar:

        def report(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield report


def _lines(description: str, unit: str) -> Progress:
    last = time.monotonic()

    def report(done: int, total: int) -> None:
        nonlocal last
        if time.monotonic() - last >= _LINE_SECONDS:
            last = time.monotonic()
            sys.stderr.write(f"{description}: {done} of {total} {unit}s, {done / max(total, 1):.0%}\n")
            sys.stderr.flush()

    return report


def part_of(report: Progress, part: int, num_parts: int) -> Progress:
    """Report the progress of one of several equal parts as that of the whole.

    Example:
        >>> part_of(print, part=1, num_parts=3)(2, 10)
        12 30
    """
    return lambda done, total: report(part * total + done, num_parts * total)


class Stopwatch:
    """Time of work by stage.

    Attributes:
        seconds: Time of each stage so far.

    Example:
        >>> watch = Stopwatch()
        >>> watch.lap("prepare")
        >>> list(watch.seconds)
        ['prepare']
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._started = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Add the time since the last lap to a stage."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._started
        self._started = now
