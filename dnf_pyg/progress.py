"""Progress and time of long work."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

__all__ = ["Progress", "Stopwatch", "part_of", "progress_bar"]

Progress = Callable[[int, int], None]
"""Function that is called with the amount of work done and the total amount."""


@contextmanager
def progress_bar(description: str, unit: str, *, hidden: bool | None = None) -> Iterator[Progress]:
    """Show a progress bar on stderr, and remove it at the end.

    Args:
        description: Text before the bar.
        unit: Unit of the work, such as ``face``.
        hidden: Show no bar; if not given, none unless stderr is a terminal.

    Yields:
        The function that moves the bar.
    """
    with tqdm(desc=description, unit=unit, leave=False, disable=hidden) as bar:

        def report(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield report


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
