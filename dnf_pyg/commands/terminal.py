"""What the program writes to the terminal."""

import sys
from typing import TextIO

__all__ = ["printable", "tell"]


def printable(text: object, encoding: str = "utf-8") -> str:
    r"""Escape what does not belong in a line of text.

    Names of files, materials and attributes come from elsewhere and may hold terminal control sequences, line breaks
    and characters that the terminal cannot show.

    Args:
        text: Text, or an object to write as text.
        encoding: Encoding of the terminal.

    Returns:
        One line in which control and formatting characters, and those outside the encoding, are escaped.

    Example:
        >>> print(printable("a\x1b[31mb\n"), printable("θ", "ascii"))
        a\x1b[31mb\n \u03b8
    """
    shown = (char if char.isprintable() else char.encode("unicode_escape").decode() for char in str(text))
    return "".join(shown).encode(encoding, "backslashreplace").decode(encoding)


def tell(*lines: object, file: TextIO | None = None) -> None:
    """Write lines, each made printable, and flush them.

    Args:
        lines: Text of each line.
        file: Where to write; stdout if not given.
    """
    file = file or sys.stdout
    encoding = getattr(file, "encoding", None) or "utf-8"
    file.write("".join(f"{printable(line, encoding)}\n" for line in lines))
    file.flush()
