"""Cache of prepared meshes: a folder of memory-mapped arrays each, written completely or not at all."""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["load_entry", "name_entry", "write_entry"]

_FORMAT = 4  # raise it when the arrays of an entry change their meaning


def name_entry(files: Iterable[Path], parameters: Mapping[str, Any]) -> str:
    """Name an entry after its first file, the content of all its files and every parameter that shapes it.

    Args:
        files: Input files.
        parameters: Parameters by name, of types that ``json`` can write.
    """
    files = list(files)
    digest = hashlib.blake2b(json.dumps([_FORMAT, dict(parameters)], sort_keys=True).encode(), digest_size=8)
    for file in files:
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "blake2b").digest())
    return f"{files[0].stem}-{digest.hexdigest()}"


def write_entry(folder: Path, arrays: Mapping[str, NDArray]) -> None:
    """Write the arrays of an entry; readers see all of them or none.

    Args:
        folder: Folder to make; if it exists already, it is kept and the arrays are dropped.
        arrays: Arrays by name.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        draft.chmod(0o755)
        for name, array in arrays.items():
            np.save(draft / f"{name}.npy", array)
        draft.rename(folder)
    except OSError:
        if not folder.is_dir():  # otherwise another process was faster
            raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def load_entry(folder: str | os.PathLike[str]) -> dict[str, NDArray]:
    """Map the arrays of an entry into memory, read-only: processes share one copy."""
    return {file.stem: np.load(file, mmap_mode="r").view(np.ndarray) for file in Path(folder).glob("*.npy")}
