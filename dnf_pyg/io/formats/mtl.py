"""Material libraries (mtl) of Wavefront obj files: the pictures that they refer to."""

import re
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from dnf_pyg.io.folder import is_beside

__all__ = ["place_pictures", "replace_name"]

_PICTURE = re.compile(
    rb"^[ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+(\S[^\r\n]*)\r*$", re.IGNORECASE | re.MULTILINE
)
_LONGEST = 1024  # bytes of a name with its folders


def place_pictures(data: bytes, folder: Path, below: PurePosixPath, place: Callable[[str], str]) -> bytes:
    r"""Replace the names of the pictures in a material library.

    Args:
        data: The material library.
        folder: Folder of the mesh.
        below: Folder of the library, relative to that of the mesh.
        place: Gives the new name of a picture, both relative to the folder of the mesh; only the part after the last
            slash may differ.

    Examples:
        >>> place_pictures(b"newmtl a\nmap_Kd -bm 1 wood.png\n", Path("absent"), PurePosixPath(), str.upper)
        b'newmtl a\nmap_Kd -bm 1 WOOD.PNG\n'
    """

    def replaced(found: re.Match[bytes]) -> bytes:
        words = found[1].rstrip()[-_LONGEST:].split()
        endings = [b" ".join(words[start:]).decode(errors="surrogateescape") for start in range(len(words))]
        for ending in endings:  # the longest name that exists: options come first, names may hold blanks
            for name in (str(below / ending.replace("\\", "/")), ending):
                if is_beside(folder, name):
                    return replace_name(found[0], name, place(name))
        return replace_name(found[0], endings[-1], place(endings[-1]))

    return _PICTURE.sub(replaced, data)


def replace_name(line: bytes, name: str, new: str) -> bytes:
    r"""Replace the last part of a path at the end of a line, if it has changed.

    Examples:
        >>> replace_name(b"map_Kd pictures\\wood.png\r", "pictures/wood.png", "pictures/oak.png")
        b'map_Kd pictures\\oak.png\r'
    """
    if name == new:
        return line
    text = line.rstrip()
    old = re.split(r"[/\\]", name)[-1].encode(errors="surrogateescape")
    return text.removesuffix(old) + PurePosixPath(new).name.encode(errors="surrogateescape") + line[len(text) :]
