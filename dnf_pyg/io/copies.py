"""Copies of the files that a mesh file refers to, in the folder that the mesh is written to."""

import os
import re
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path, PurePosixPath

from dnf_pyg.errors import MeshFileWarning
from dnf_pyg.io.folder import CompanionError, find_beside
from dnf_pyg.io.formats import DOCUMENTS
from dnf_pyg.io.formats.mtl import place_pictures

__all__ = ["Copies", "warn_left_out"]

_MATERIALS = (".mtl",)
_PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".gif", ".webp", ".dds", ".ktx", ".ktx2",
             ".basis", ".hdr", ".exr", ".psd", ".ppm", ".pgm", ".pnm", ".sgi", ".rgb")  # fmt: skip
_BUFFERS = (".bin", ".glbin", ".glbuf")
_SHOWN = 5  # names in a warning


class Copies:
    """Files to write beside a mesh: copies of those that it refers to.

    A copy keeps its name where the name is free, or taken by a file with the same content. Otherwise it gets a new one,
    and what refers to it is changed. No file that exists is ever replaced, nothing is written through a link, and a
    copy has the ending of a material, a picture or a buffer.

    Args:
        target: Mesh file to write.

    Attributes:
        files: Content of the files to write, by path.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.files: dict[Path, bytes] = {}
        self._planned: set[str] = set()  # their paths, as file systems that ignore case compare them

    def carry(self, data: bytes, source: Path) -> bytes:
        """Plan copies of all files that a mesh refers to.

        Args:
            data: The mesh in the format of the target.
            source: The mesh file that it was read from.

        Returns:
            The mesh, which refers to the copies.

        Warns:
            MeshFileWarning: If a file is missing or must not be copied; it is left out.
        """
        if source.parent.resolve() == self.target.parent.resolve():
            return data
        left_out: dict[str, str] = {}  # reason by name

        def place(name: str, endings: tuple[str, ...]) -> str:
            try:
                path = find_beside(source.parent, name)
                content = _read(path, endings)
                relative = PurePosixPath(path.relative_to(source.parent).as_posix())
                if path.name.lower().endswith(_MATERIALS):
                    content = place_pictures(content, source.parent, relative.parent, place_picture)
                given = self.add(str(relative), content)
            except CompanionError as error:
                left_out[name] = str(error)
                return name
            return name if given == str(relative) else given

        place_picture = cache(lambda name: place(name, _PICTURES))
        place_any = cache(lambda name: place(name, _MATERIALS + _PICTURES + _BUFFERS))
        data = DOCUMENTS[self.target.suffix.lower()].place_companions(data, source.parent, place_any)
        warn_left_out(source, left_out)
        return data

    def add(self, name: str, data: bytes) -> str:
        """Plan to write a file under a name of our own; return the name that it gets.

        Args:
            name: Wanted name, relative to the folder of the target.
            data: Content of the file.

        Raises:
            CompanionError: If its folder is a link or a file, or all names that would do are taken.
        """
        relative = PurePosixPath(name)
        stem = re.sub(r"[^\w-]", "_", self.target.stem)
        tried = [relative, *(relative.with_name(f"{stem}{number}_{relative.name}") for number in ("", *range(2, 100)))]
        for candidate in tried:
            path = self.target.parent / candidate
            if self._is_free(path, data):
                if not os.path.lexists(path):
                    self.files[path] = data
                    self._planned.add(str(path).casefold())
                return str(candidate)
        raise CompanionError("there are too many files of this name in the folder of the result")

    def _is_free(self, path: Path, data: bytes) -> bool:
        """Whether a copy may get this name.

        Raises:
            CompanionError: If its folder is a link or a file.
        """
        for folder in path.parents[: len(path.relative_to(self.target.parent).parts) - 1]:
            if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
                raise CompanionError(f"'{folder}' in the folder of the result is a link or a file")
        if str(path).casefold() in self._planned:
            return path in self.files and self.files[path] == data
        if not os.path.lexists(path):
            return True
        return not path.is_symlink() and path.is_file() and path.read_bytes() == data


def _read(path: Path, endings: tuple[str, ...]) -> bytes:
    if path.name.startswith(".") or not path.name.lower().endswith(endings):
        raise CompanionError(f"its name does not end in {', '.join(endings[:4])} or the like")
    try:
        return path.read_bytes()
    except OSError as error:
        raise CompanionError(f"it cannot be read ({error.strerror})") from error


def warn_left_out(source: Path, reasons: Mapping[str, str]) -> None:
    """Warn of files that a mesh refers to and that do not come along.

    Args:
        source: The mesh file.
        reasons: Why a file is left out, by its name; no warning if there is none.
    """
    if reasons:
        shown = [f"{name!r}, but {reason}" for name, reason in reasons.items()][:_SHOWN]
        shown += [f"{len(reasons) - _SHOWN} more"] * (len(reasons) > _SHOWN)
        warnings.warn(
            f"Expected the files that '{source}' refers to in or below its folder (got {'; '.join(shown)}). "
            "They are left out: put them beside the mesh and write it again.",
            MeshFileWarning,
            stacklevel=5,
        )
