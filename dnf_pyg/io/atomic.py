"""Files that appear whole or not at all."""

import contextlib
import errno
import os
import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path

from dnf_pyg.errors import OutputError

__all__ = ["check_writable", "write_bytes", "write_files"]


def check_writable(path: Path) -> None:
    """Make sure, before long work, that a file can be written.

    Args:
        path: File to be written later; nothing is left there now.

    Raises:
        OutputError: If its folder does not exist or nothing can be written there.

    Examples:
        >>> check_writable(Path("/absent/mesh.obj"))
        Traceback (most recent call last):
        dnf_pyg.errors.OutputError: Expected a writable folder ... (got No such file or directory). Create it ...
    """
    try:
        real = _real(path)
        with tempfile.NamedTemporaryFile(dir=real.parent, prefix=_draft_prefix(real)):
            pass
    except OSError as error:
        raise _no_folder(path, error) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write beside ``path`` under another name, then move it there in one step.

    Args:
        path: File to write; one that exists is replaced, and a symbolic link is written through.
        data: Its content.

    Raises:
        OutputError: If it cannot be written; nothing is left behind then.

    Examples:
        >>> write_bytes(Path("/absent/mesh.obj"), b"")
        Traceback (most recent call last):
        dnf_pyg.errors.OutputError: Expected a writable folder ... (got No such file or directory). Create it ...
    """
    write_files({path: data})


def write_files(files: Mapping[Path, bytes], new: Collection[Path] = ()) -> None:
    """Write several files that belong together; each gets its name when all of them are on the disk.

    Args:
        files: Content of each file; those that exist are replaced, and symbolic links are written through.
        new: Those of them that must not exist yet, whose folders are made where they are missing.

    Raises:
        OutputError: If one cannot be written; nothing is left behind then.
        FileExistsError: If one of ``new`` exists; nothing is left behind then either.
    """
    drafts: dict[Path, str] = {}
    made: list[Path] = []
    try:
        for path, data in files.items():
            try:
                if path in new:
                    made += _make_folders(path.parent)
                real = path if path in new else _real(path)
                descriptor, drafts[path] = tempfile.mkstemp(dir=real.parent, prefix=_draft_prefix(real))
            except OSError as error:
                raise _no_folder(path, error) from error
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            Path(drafts[path]).chmod(_permissions(real))
        for path in files:
            if path in new:
                path.touch(exist_ok=False)
                made.append(path)
            os.replace(drafts[path], path if path in new else _real(path))
        made.clear()
    except (OutputError, FileExistsError):
        raise
    except OSError as error:
        reason = f"Expected to be able to write '{path}' (got {error.strerror})"
        in_use = isinstance(error, PermissionError)  # Windows replaces no file that a program has open
        remedy = "Close the programs that have it open" if in_use else "Free some space"
        raise OutputError(f"{reason}. {remedy} or choose another place.") from error
    finally:
        for draft in drafts.values():
            with contextlib.suppress(FileNotFoundError):
                Path(draft).unlink()
        for path in reversed(made):
            with contextlib.suppress(OSError):
                path.rmdir() if path.is_dir() else path.unlink()


def _real(path: Path) -> Path:
    """Where a path leads through symbolic links, of which the last may lead nowhere yet."""
    real = Path(os.path.realpath(path))
    if real.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return real


def _make_folders(folder: Path) -> list[Path]:
    """Make a folder and those above it; return the ones that were missing, from the outermost."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for path in reversed(missing):
        path.mkdir(exist_ok=True)
    return missing[::-1]


def _no_folder(path: Path, error: OSError) -> OutputError:
    reason = f"Expected a writable folder for '{path}' (got {error.strerror})"
    return OutputError(f"{reason}. Create it or choose another one.")


def _draft_prefix(path: Path) -> str:
    """Beginning of the name of a draft, hidden, and short enough beside the longest name that a folder can hold."""
    return f".{path.name[:20]}."


def _permissions(path: Path) -> int:
    """Those of the file that is replaced, or of new files of this process (mkstemp makes private ones)."""
    if path.exists():
        return path.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
