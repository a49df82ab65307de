"""Noisy and clean meshes that belong together, by the layout of the CNR benchmark."""

from pathlib import Path

from dnf_pyg.errors import DataError
from dnf_pyg.io import SUFFIXES

__all__ = ["find_test_folder", "pair_meshes"]


def pair_meshes(folder: Path) -> list[tuple[Path, Path]]:
    """Pair every mesh in ``noisy/`` with the clean one in ``original/`` whose name it starts with, sorted by name.

    Clean ``NAME.obj`` belongs to ``NAME_n1.obj``, ``NAME_noisy.ply`` and so on; the longest such name counts.

    Raises:
        DataError: If there is no pair.
    """
    clean = {path.stem: path for path in sorted((folder / "original").iterdir()) if path.suffix.lower() in SUFFIXES}
    pairs = []
    for noisy in sorted((folder / "noisy").iterdir()):
        names = [name for name in clean if noisy.stem.startswith(f"{name}_") and noisy.suffix.lower() in SUFFIXES]
        if names:
            pairs.append((noisy, clean[max(names, key=len)]))
    if not pairs:
        raise DataError(
            f"Expected noisy/NAME_n1.obj and original/NAME.obj in '{folder}' (got no such pair): rename them"
        )
    return pairs


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
