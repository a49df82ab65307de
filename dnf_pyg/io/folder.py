"""Files beside a mesh: where a file that a mesh file names may lie."""

import os
import re
import stat
import unicodedata
from pathlib import Path, PurePosixPath

__all__ = ["CompanionError", "find_beside", "is_beside"]

_ABSOLUTE = re.compile(r"/|[A-Za-z][A-Za-z0-9+.-]*:")  # a root, a drive letter or the scheme of a URI


class CompanionError(ValueError):
    """A file named by a mesh file that must not be read or cannot be found; the text is the reason."""


def find_beside(folder: Path, name: str) -> Path:
    """Find a file that a mesh file names.

    Only regular files in or below the folder of the mesh are found. Backslashes separate folders, too. Where no file
    has exactly this name, upper and lower case and the two Unicode forms of accented letters count as equal, and bytes
    that are not UTF-8 are read as Latin-1.

    Args:
        folder: Folder of the mesh.
        name: Name in the mesh file; bytes that are not UTF-8 as surrogates.

    Returns:
        The file, as a path below ``folder``.

    Raises:
        CompanionError: If the name is absolute, leads out of the folder, also through a symbolic link, or does not
            lead to a regular file.

    Examples:
        >>> find_beside(Path(), "../secret.png")
        Traceback (most recent call last):
        dnf_pyg.io.folder.CompanionError: it lies outside the folder of the mesh
    """
    portable = name.replace("\\", "/")
    if _ABSOLUTE.match(portable):
        raise CompanionError("it is an absolute path")
    parts = PurePosixPath(os.path.normpath(portable)).parts
    if parts[:1] == ("..",):
        raise CompanionError("it lies outside the folder of the mesh")
    path = folder
    try:
        for part in parts:
            path = _entry(path, part)
        kind = path.stat().st_mode
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError) as error:  # also too long, a null byte, links in a circle
        raise CompanionError("it does not exist") from error
    if not inside:
        raise CompanionError("it is a link that leaves the folder of the mesh")
    if not stat.S_ISREG(kind):
        raise CompanionError("it is not a regular file")
    return path


def is_beside(folder: Path, name: str) -> bool:
    """Whether :func:`find_beside` finds a file."""
    try:
        find_beside(folder, name)
    except CompanionError:
        return False
    return True


def _entry(folder: Path, name: str) -> Path:
    """Path of the entry of a folder that a mesh file means by a name."""
    exact = folder / name
    if exact.exists():
        return exact
    wanted = {_folded(name), _folded(os.fsencode(name).decode("latin-1"))}
    return next((entry for entry in sorted(folder.iterdir()) if _folded(entry.name) in wanted), exact)


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()
