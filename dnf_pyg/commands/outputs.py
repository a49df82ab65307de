"""Checks of the files that a command is going to write, before the long work."""

from pathlib import Path

from dnf_pyg.errors import OutputError
from dnf_pyg.io import SUFFIXES
from dnf_pyg.io.atomic import check_writable

__all__ = ["check_output"]


def check_output(path: Path, *, overwrite: bool, suffixes: tuple[str, ...] = SUFFIXES) -> None:
    """Make sure that a file can be written and replaces none unless asked to.

    Args:
        path: File to write later.
        overwrite: Whether it may exist.
        suffixes: Endings that its format may have.

    Raises:
        OutputError: If its ending is another, its folder is missing or not writable, or it exists already.

    Example:
        >>> check_output(Path("mesh.docx"), overwrite=False)
        Traceback (most recent call last):
        dnf_pyg.errors.OutputError: Expected an output ending in ... (got 'mesh.docx'). Choose one of these endings.
    """
    if path.suffix.lower() not in suffixes:
        raise OutputError(
            f"Expected an output ending in {', '.join(suffixes)} (got '{path}'). Choose one of these endings."
        )
    check_writable(path)
    if path.exists() and not overwrite:
        raise OutputError(f"Expected a new output file (got '{path}', which exists). Add --overwrite to replace it.")
