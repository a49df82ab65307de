"""Report pages in notebooks."""

from html import escape
from pathlib import Path

from dnf_pyg.errors import DataError

__all__ = ["PageView"]


class PageView:
    """Show a page written by :func:`~dnf_pyg.view.write_report` as the output of a notebook's cell.

    The notebook keeps a copy of the page, which works without network and after the file is gone.

    Args:
        path: The page.
        height: Height of the frame, CSS pixels.

    Raises:
        DataError: If the page cannot be read.

    Example:
        >>> PageView("absent.html")
        Traceback (most recent call last):
        dnf_pyg.errors.DataError: Expected a readable page (got 'absent.html': No such file or directory). Write it ...
    """

    def __init__(self, path: str | Path, height: int = 720) -> None:
        try:
            self.page = Path(path).read_text(encoding="utf-8")
        except OSError as error:
            raise DataError(
                f"Expected a readable page (got '{path}': {error.strerror}). Write it with write_report."
            ) from error
        self.height = height

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {int(self.height)}px; border: 0"
        return f'<iframe srcdoc="{escape(self.page)}" style="{style}"></iframe>'
