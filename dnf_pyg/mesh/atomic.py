"""Files that appear whole or not at all."""

import contextlib
import os
import tempfile
from pathlib import Path

from dnf_pyg.errors import MeshFileError

__all__ = ["write_bytes"]


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
    try:
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        reason = f"Expected a writable folder for '{path}' (got: {error.strerror})"
        raise MeshFileError(f"{reason}: create it or choose another") from error
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        Path(temporary).chmod(0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        reason = f"Expected to write '{path}' (got: {error.strerror})"
        raise MeshFileError(f"{reason}: free some space or choose another place") from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            Path(temporary).unlink()


def _umask() -> int:
    """Permissions that new files of this process lack (mkstemp makes private ones)."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
