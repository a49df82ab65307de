"""Files that appear whole or not at all."""

import contextlib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from dnf_pyg.errors import MeshFileError

__all__ = ["check_writable", "write_bytes", "write_files"]


def check_writable(path: Path) -> None:
    """Make sure, before long work, that a file can be written.

    Args:
        path: File to be written later; nothing is left there now.

    Raises:
        MeshFileError: If its folder does not exist or nothing can be written there.

    Examples:
        >>> check_writable(Path("/absent/mesh.obj"))
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a writable folder ... (got: No such file or directory): create it ...
    """
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=_draft_prefix(path)):
            pass
    except OSError as error:
        raise _no_folder(path, error) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write beside ``path`` under another name, then move it there in one step.

    Args:
        path: File to write; one that exists is replaced.
        data: Its content.

    Raises:
        MeshFileError: If it cannot be written; nothing is left behind then.

    Examples:
        >>> write_bytes(Path("/absent/mesh.obj"), b"")
        Traceback (most recent call last):
        dnf_pyg.errors.MeshFileError: Expected a writable folder ... (got: No such file or directory): create it ...
    """
    write_files({path: data})


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write several files that belong together; each gets its name when all of them are on the disk.

    Args:
        files: Content of each file; those that exist are replaced.

    Raises:
        MeshFileError: If one cannot be written; nothing is left behind then.
    """
    drafts: dict[Path, str] = {}
    try:
        for path, data in files.items():
            try:
                descriptor, drafts[path] = tempfile.mkstemp(dir=path.parent, prefix=_draft_prefix(path))
            except OSError as error:
                raise _no_folder(path, error) from error
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            Path(drafts[path]).chmod(_permissions(path))
        for path in files:
            os.replace(drafts[path], path)
    except MeshFileError:
        raise
    except OSError as error:
        reason = f"Expected to write '{path}' (got: {error.strerror})"
        raise MeshFileError(f"{reason}: free some space or choose another place") from error
    finally:
        for draft in drafts.values():
            with contextlib.suppress(FileNotFoundError):
                Path(draft).unlink()


def _no_folder(path: Path, error: OSError) -> MeshFileError:
    reason = f"Expected a writable folder for '{path}' (got: {error.strerror})"
    return MeshFileError(f"{reason}: create it or choose another")


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
