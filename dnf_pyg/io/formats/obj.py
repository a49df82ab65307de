"""Wavefront obj files."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from dnf_pyg.io.folder import is_beside
from dnf_pyg.io.formats.document import Document, Floats, Ints, fan
from dnf_pyg.io.formats.mtl import replace_name
from dnf_pyg.io.formats.normals import moved_normals
from dnf_pyg.io.formats.text import check_text, number_text, parse_numbers, replace_tokens

__all__ = ["ObjDocument"]

_LINE_END = re.compile(rb"(?<!\\)(?<!\\\r)\n")
_LIBRARY = re.compile(rb"^((?:\xef\xbb\xbf)?[ \t]*mtllib[ \t]+)(\S[^\r\n]*)\r*$", re.IGNORECASE | re.MULTILINE)
_BLANKS = re.compile(rb"([ \t]+)")


class ObjDocument(Document):
    r"""A Wavefront obj file: ``v`` lines move, ``vn`` lines follow them, all else stays.

    Examples:
        >>> document = ObjDocument(b"v 0 0 0\nv 1 0 0 # tip\nv 0 1 0\nf 1 2 3\n", Path())
        >>> document.with_positions(document.pos * [[2], [2], [1]])
        b'v 0 0 0\nv 2.000000000 0.000000000 0.000000000 # tip\nv 0 1 0\nf 1 2 3\n'
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        check_text(data)
        data = self.data
        self.lines = _LINE_END.split(data) if b"\\\n" in data or b"\\\r\n" in data else data.split(b"\n")
        self.rows = self._rows_by_keyword()
        self.pos = self._numbers(b"v")
        self.normal = self._numbers(b"vn")
        self._read_faces()

    def _rewritten(self, pos: Floats) -> bytes:
        lines = list(self.lines)
        self._replace(lines, b"v", self.moved(pos), pos, self._used(pos))
        if len(self.corner_normal):
            face = self.face[self.has_normal]
            normal = moved_normals(self.normal, self.corner_normal, face, self.pos, pos)
            self._replace(lines, b"vn", np.flatnonzero((normal != self.normal).any(axis=1)), normal, normal)
        return b"\n".join(lines)

    @classmethod
    def place_companions(cls, data: bytes, folder: Path, place: Callable[[str], str]) -> bytes:
        """Replace the names of material libraries; a line may hold several, and a name may hold blanks."""

        def replaced(found: re.Match[bytes]) -> bytes:
            names = found[2].rstrip()
            whole = names.decode(errors="surrogateescape")
            if is_beside(folder, whole) or len(whole.split()) < 2:
                return replace_name(found[0], whole, place(whole))
            words = _BLANKS.split(names)  # with the blanks between them
            for number, word in enumerate(words[::2]):
                name = word.decode(errors="surrogateescape")
                words[2 * number] = replace_name(word, name, place(name))
            return found[1] + b"".join(words) + found[0][found.end(1) - found.start() + len(names) :]

        return _LIBRARY.sub(replaced, data)

    def _rows_by_keyword(self) -> dict[bytes, list[int]]:
        by_head: dict[bytes, list[int]] = {}
        for row, line in enumerate(self.lines):
            by_head.setdefault(line[:2].lower(), []).append(row)
        rows: dict[bytes, list[int]] = {b"v": [], b"vn": [], b"f": []}
        for head, found in by_head.items():
            if head in (b"v ", b"vn", b"f "):
                rows[head.rstrip()] += found
            elif head not in (b"vt", b"mt"):
                for row in found:
                    for keyword in self.lines[row].split(None, 1)[:1]:
                        rows.get(keyword.lower(), []).append(row)
        return {keyword: sorted(found) for keyword, found in rows.items()}

    def _read_faces(self) -> None:
        lines = self._plain_lines(b"f")
        count = np.array([len(line.split()) - 1 for line in lines], dtype=np.int64)
        reference = _references(
            [word for line in lines for word in line.split()[1:]]
        )  # (C, 3): vertex, texture, normal
        corner = fan(count)
        self.face = self._absolute(reference[:, 0], b"v", count)[corner]
        self.has_normal = (reference[:, 2] != 0)[corner].all(axis=1) & (len(self.normal) > 0)  # (F,)
        above = self._absolute(np.where(reference[:, 2] == 0, 1, reference[:, 2]), b"vn", count)
        self.corner_normal = above[corner][self.has_normal]
        if self.corner_normal.max(initial=0) >= max(len(self.normal), 1):
            raise ValueError(f"a face names normal {self.corner_normal.max() + 1} of {len(self.normal)}")

    def _absolute(self, reference: Ints, keyword: bytes, count: Ints) -> Ints:
        """Count from 0; negative references count back from the lines above the face."""
        if (reference == 0).any():
            raise ValueError("a face names number 0, but obj counts from 1")
        above = np.repeat(np.searchsorted(self.rows[keyword], self.rows[b"f"]), count)
        return np.where(reference < 0, above + reference, reference - 1)

    def _plain_lines(self, keyword: bytes) -> list[bytes]:
        """Lines of a keyword in one piece and without comments."""
        lines = [self.lines[row] for row in self.rows[keyword]]
        text = b"\n".join(lines)
        if b"\\\n" in text or b"\\\r\n" in text:
            lines = [re.sub(rb"\\\r?\n", b" ", line) for line in lines]
        return [line.split(b"#", 1)[0] for line in lines] if b"#" in text else lines

    def _numbers(self, keyword: bytes) -> Floats:
        lines = self._plain_lines(keyword)
        words = [word for line in lines for word in line.split()[1:4]]  # flat: a list per line would cost far more
        if len(words) != 3 * len(lines):
            raise ValueError(f"a line of '{keyword.decode()}' has fewer than three numbers")
        return parse_numbers(words, 3)

    def _replace(self, lines: list[bytes], keyword: bytes, changed: Ints, values: Floats, used: Floats) -> None:
        rows = self.rows[keyword]
        own = [word for row in rows[:: max(1, len(rows) // 1000)] for word in self.lines[row].split()[1:4]]
        for number, text in zip(changed.tolist(), number_text(values[changed], used, own), strict=True):
            lines[rows[number]] = replace_tokens(lines[rows[number]], (1, 2, 3), text)


def _references(words: list[bytes]) -> Ints:
    """Vertex, texture and normal numbers (C, 3) of corners such as ``7``, ``7/8``, ``7//9`` and ``7/8/9``; 0: none."""
    reference = np.zeros((len(words), 3), dtype=np.int64)
    text = b" ".join(words)
    slashes = {word.count(b"/") for word in words} if b"/" in text else {0}
    if slashes == {0}:
        reference[:, 0] = np.array(words, dtype=np.int64)
    elif len(slashes) == 1 and not any(word.endswith(b"/") for word in words):
        fields = slashes.pop() + 1
        numbers = text.replace(b"//", b"/0/").replace(b"/", b" ").split()
        reference[:, :fields] = np.array(numbers, dtype=np.int64).reshape(-1, fields)
    else:
        for row, word in enumerate(words):
            fields_of_word = [int(field or 0) for field in word.split(b"/")]
            reference[row, : len(fields_of_word)] = fields_of_word
    return reference
