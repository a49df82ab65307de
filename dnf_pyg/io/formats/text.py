"""Numbers and lines of text files."""

import re
from collections.abc import Iterable, Sequence

import numpy as np

from dnf_pyg.io.formats.document import Floats, UnsupportedError

__all__ = ["check_text", "number_text", "parse_numbers", "replace_tokens"]

_SEPARATOR = re.compile(rb"((?:\s|\\\r?\n)+)")


def check_text(data: bytes) -> None:
    r"""Refuse text whose lines or characters cannot be told apart.

    Raises:
        UnsupportedError: If it is UTF-16, or its lines end with carriage returns alone.

    Examples:
        >>> check_text("v 0 0 0\n".encode("utf-16"))
        Traceback (most recent call last):
        dnf_pyg.io.formats.document.UnsupportedError: it is text in UTF-16
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or (b"\0" in data[:2] and data[:2].strip(b"\0")):
        raise UnsupportedError("it is text in UTF-16", "Save it as UTF-8.")
    if b"\r" in data and b"\n" not in data:
        raise UnsupportedError("its lines end with carriage returns alone", "Convert them to line feeds.")


def parse_numbers(words: Iterable[bytes], columns: int) -> Floats:
    """Parse words as numbers, (N, columns).

    Raises:
        ValueError: If a word is not a number.
        UnsupportedError: If a number has a decimal comma.

    Examples:
        >>> parse_numbers([b"1", b"2,5"], 2)
        Traceback (most recent call last):
        dnf_pyg.io.formats.document.UnsupportedError: its numbers have a decimal comma, as in '2,5'
    """
    words = list(words)
    try:
        return np.array(words, dtype=np.float64).reshape(-1, columns)
    except ValueError:
        comma = next((word for word in words if re.fullmatch(rb"[-+]?\d*,\d+([eE][-+]?\d+)?", word)), None)
        if comma is None:
            raise
        raise UnsupportedError(
            f"its numbers have a decimal comma, as in '{comma.decode()}'", "Write them with a decimal point."
        ) from None


def number_text(values: Floats, used: Floats, own: Sequence[bytes] = ()) -> list[list[bytes]]:
    """Write numbers as text, with digits that resolve 1e-9 of an extent and at least as many as the file has.

    Args:
        values: Numbers to write, (N, C).
        used: Numbers whose extent counts, (M, C).
        own: Some of the file's numbers, as they are written there.

    Examples:
        >>> number_text(np.array([[0.5, 1 / 3]]), np.array([[0.0, 0.0], [100.0, 100.0]]))
        [[b'0.50000000', b'0.33333333']]
        >>> number_text(np.array([[1 / 3]]), np.array([[0.0], [100.0]]), [b"12.1234567890"])
        [[b'0.3333333333']]
    """
    used = used[np.isfinite(used).all(axis=1)]
    extent = float(np.ptp(used, axis=0).max()) if len(used) else 0.0
    extent = extent or float(np.abs(used).max(initial=0.0)) or 1.0
    needed = 10 - int(np.ceil(np.log10(extent)))
    present = max((_decimals(word) for word in own), default=0)
    decimals = int(np.clip(max(needed, min(present, needed + 7)), 0, 300))  # 17 digits are all that float64 holds
    return [[b"%.*f" % (decimals, value) for value in row] for row in values.tolist()]


def _decimals(word: bytes) -> int:
    """Digits after the point that a written number needs."""
    mantissa, _, exponent = word.lower().partition(b"e")
    return len(mantissa.partition(b".")[2]) - int(exponent or 0)


def replace_tokens(line: bytes, columns: Sequence[int], values: Sequence[bytes]) -> bytes:
    """Replace words of a line and keep its spacing.

    Examples:
        >>> replace_tokens(b"v  1 2 3 # tip", (1, 2, 3), (b"7", b"8", b"9"))
        b'v  7 8 9 # tip'
    """
    words = line.split(b" ")
    if b"" not in words and not line.count(b"\t") and not line.count(b"\r") and not line.count(b"\\"):  # the usual line
        for column, value in zip(columns, values, strict=True):
            words[column] = value
        return b" ".join(words)
    parts = _SEPARATOR.split(line)
    indent = 2 if parts[0] == b"" else 0
    for column, value in zip(columns, values, strict=True):
        parts[2 * column + indent] = value
    return b"".join(parts)
