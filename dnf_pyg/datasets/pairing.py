"""Which files belong together: noisy and clean meshes, and the meshes that are held back from training."""

import re
from collections.abc import Collection, Sequence
from pathlib import Path

from dnf_pyg.errors import DataError
from dnf_pyg.io import SUFFIXES

__all__ = ["MeshPair", "cnr_pairs", "find_pairs", "find_test_folder", "list_meshes", "pair_meshes", "split_pairs"]

MeshPair = tuple[Path | None, Path]
"""Noisy file, or ``None`` where the noise is drawn, and clean file of a mesh."""


def list_meshes(folder: str | Path, names: Collection[str] | None = None) -> list[Path]:
    """List the mesh files of a folder, sorted by name.

    Args:
        folder: Folder of meshes.
        names: File names without suffix; every mesh of the folder if not given.

    Raises:
        DataError: If the folder, a named mesh or any mesh is missing.

    Example:
        >>> list_meshes("absent")
        Traceback (most recent call last):
        dnf_pyg.errors.DataError: Expected a folder of meshes (got 'absent', which does not exist). Check the path.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DataError(f"Expected a folder of meshes (got '{folder}', which does not exist). Check the path.")
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    absent = sorted(set(names or ()) - {path.stem for path in files})
    if absent or not files:
        raise DataError(
            f"Expected meshes ({', '.join(SUFFIXES)}) in '{folder}' (got none named {absent or 'anything'}). "
            "Check the folder, or change `names`."
        )
    return [path for path in files if names is None or path.stem in names]


def find_pairs(noisy: str | Path, clean: str | Path, pattern: str) -> list[tuple[Path, Path]]:
    """Pair the noisy and clean meshes of two folders by a regular expression.

    Args:
        noisy: Folder of noisy meshes.
        clean: Folder of clean meshes; may be the same.
        pattern: Regular expression that a noisy name (without suffix) matches; its first group is the clean name.

    Raises:
        DataError: If a folder is missing, or meshes of either folder have no partner: all of them are listed.
    """
    matches = {path: re.fullmatch(pattern, path.stem) for path in list_meshes(noisy)}
    same = Path(noisy) == Path(clean)
    targets = {path.stem: path for path in list_meshes(clean) if not (same and matches[path])}
    pairs = [(path, targets[match[1]]) for path, match in matches.items() if match and match[1] in targets]
    paired = {path for pair in pairs for path in pair}
    alone = [str(path) for path in sorted({*matches, *targets.values()} - paired)]
    if alone:
        raise DataError(
            f"Expected a partner for every mesh of '{noisy}' and '{clean}' by the pattern '{pattern}' "
            f"(got none for {', '.join(alone)}). Rename or move these meshes, or change `pattern`."
        )
    return pairs


def pair_meshes(folder: Path) -> list[tuple[Path, Path]]:
    """Pair every mesh in ``noisy/`` with the mesh in ``original/`` whose name it starts with, sorted by noisy name.

    Clean ``NAME.obj`` belongs to ``NAME_n1.obj``, ``NAME_noisy.ply`` and so on; the longest such name counts.

    Raises:
        DataError: If there is no pair.
    """
    clean = {path.stem: path for path in list_meshes(folder / "original")}
    pairs = []
    for noisy in list_meshes(folder / "noisy"):
        names = [name for name in clean if noisy.stem.startswith(f"{name}_")]
        if names:
            pairs.append((noisy, clean[max(names, key=len)]))
    if not pairs:
        raise DataError(
            f"Expected noisy/NAME_n1.obj and original/NAME.obj in '{folder}' (got no such pair). Rename the meshes."
        )
    return pairs


def cnr_pairs(root: str | Path, subset: str, split: str) -> list[tuple[Path, Path]]:
    """Pair the noisy and clean meshes of one split of the CNR benchmark.

    Where the subset has a ``train_list.txt`` or ``test_list.txt``, only the names in it count.

    Args:
        root: Folder that holds the subsets.
        subset: Name of the subset.
        split: ``train`` or ``test``.

    Raises:
        DataError: If a folder is missing, holds no pair, or lacks a mesh of the list.
    """
    folder = Path(root) / subset / split
    if not _holds_pairs(folder):
        raise DataError(
            f"Expected the CNR benchmark with '{folder / 'original'}' and '{folder / 'noisy'}' (got no such folders). "
            "The data come with Wang, Liu and Tong, 'Mesh Denoising via Cascaded Normal Regression', 2016, on the "
            "authors' project page; unpack them so that ROOT/SUBSET/{train,test}/{original,noisy} hold the meshes."
        )
    listing = Path(root) / subset / f"{split}_list.txt"
    pairs = pair_meshes(folder)
    if not listing.is_file():
        return pairs
    names = {Path(line.strip()).stem for line in listing.read_text().splitlines() if line.strip()}
    absent = sorted(names - {clean.stem for _, clean in pairs})
    if absent:
        raise DataError(
            f"Expected every mesh of '{listing}' with a noisy version in '{folder}' (got none for {absent}). "
            "Add the meshes, or take their names off the list."
        )
    return [pair for pair in pairs if pair[1].stem in names]


def find_test_folder(root: Path) -> Path:
    """Find the folder with ``original/`` and ``noisy/``: ``root`` itself, ``root/test``, or the one ``root/*/test``.

    Raises:
        DataError: If there is none, or more than one.

    Example:
        >>> find_test_folder(Path("absent"))
        Traceback (most recent call last):
        dnf_pyg.errors.DataError: Expected a folder with original/ and noisy/ (got 'absent', none in it or below). ...
    """
    found = [path for path in (root, root / "test", *sorted(root.glob("*/test"))) if _holds_pairs(path)]
    if len(found) != 1:
        below = f"all of {', '.join(map(str, found))}" if found else "none in it or below"
        raise DataError(f"Expected a folder with original/ and noisy/ (got '{root}', {below}). Name that folder.")
    return found[0].resolve()


def split_pairs(pairs: Sequence[MeshPair], split: str, val_share: float) -> list[MeshPair]:
    """Hold back a share of the clean meshes, with all their noisy versions, evenly spread over their names.

    Args:
        pairs: All pairs.
        split: ``train`` for the pairs of the other meshes, anything else for those held back.
        val_share: Share of the clean meshes that are held back, at least one of them; 0 holds back none.

    Raises:
        DataError: If ``val_share`` is not from 0 to below 1, or leaves no mesh for the split.

    Example:
        >>> pairs = [(None, Path(f"{name}.ply")) for name in "abcd"]
        >>> [clean.stem for _, clean in split_pairs(pairs, "val", 0.5)]
        ['b', 'd']
    """
    if not 0 <= val_share < 1:
        raise DataError(f"Expected 'val_share' from 0 to below 1 (got {val_share}). It is a share of the meshes.")
    held_back = _spread(sorted({clean.stem for _, clean in pairs}), val_share) if val_share else set()
    chosen = [pair for pair in pairs if (pair[1].stem in held_back) == (split != "train")]
    if not chosen:
        raise DataError(
            f"Expected at least one mesh for '{split}' (got {len(pairs)} files and 'val_share' {val_share}). "
            "Add meshes, or change `val_share`."
        )
    return chosen


def _spread(names: Sequence[str], share: float) -> set[str]:
    count = max(1, round(share * len(names)))
    return {names[(2 * i + 1) * len(names) // (2 * count)] for i in range(count)}


def _holds_pairs(folder: Path) -> bool:
    return all((folder / part).is_dir() for part in ("original", "noisy"))
