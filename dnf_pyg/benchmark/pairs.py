"""The folder that holds the test meshes."""

from pathlib import Path

from dnf_pyg.errors import DataError

__all__ = ["find_test_folder"]


def find_test_folder(root: Path) -> Path:
    """Find the folder with ``original/`` and ``noisy/``: the given one, its ``test``, or the one ``*/test`` below.

    Raises:
        DataError: If there is none, or more than one.

    Example:
        >>> find_test_folder(Path("absent"))
        Traceback (most recent call last):
        dnf_pyg.errors.DataError: Expected a folder with original/ and noisy/ (got 'absent', none in it or below): ...
    """
    found = [path for path in (root, root / "test", *sorted(root.glob("*/test"))) if _holds_meshes(path)]
    if len(found) != 1:
        below = f"all of {', '.join(map(str, found))}" if found else "none in it or below"
        raise DataError(f"Expected a folder with original/ and noisy/ (got '{root}', {below}): name that folder")
    return found[0].resolve()


def _holds_meshes(folder: Path) -> bool:
    return all((folder / part).is_dir() for part in ("original", "noisy"))
