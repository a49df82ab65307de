"""The header of ply files: which elements there are, and how a row of each is laid out."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

__all__ = ["Element", "Header", "Property", "read_header"]

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_MOST = 1000  # elements and properties; every row is searched for them
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class Property(NamedTuple):
    """A column of an element; ``length_type`` is that of a list's length, or None for a single value."""

    name: str
    type: np.dtype
    length_type: np.dtype | None


@dataclass
class Element:
    """A table of the file."""

    name: str
    num_rows: int
    properties: list[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether a row has lists of any length."""
        return any(described.length_type is not None for described in self.properties)

    def column(self, *names: str) -> int | None:
        """Position of the first property with one of the names."""
        return next((i for i, found in enumerate(self.properties) if found.name in names), None)

    def row_type(self, lengths: dict[str, int]) -> np.dtype:
        """Layout of a row whose lists have the given lengths; length and values of list ``x``: ``x#`` and ``x``."""
        fields: list[tuple] = []
        for name, type_, length_type in self.properties:
            fields += (
                [(name, type_)] if length_type is None else [(name + "#", length_type), (name, type_, (lengths[name],))]
            )
        return np.dtype(fields)


class Header(NamedTuple):
    """Elements in the order of the file, the sign of its byte order (empty for text), and its length in bytes."""

    elements: list[Element]
    byte_order: str
    length: int

    def element(self, name: str) -> Element | None:
        """The element of that name."""
        return next((element for element in self.elements if element.name == name), None)


def read_header(data: bytes) -> Header:
    r"""Read the header of a ply file.

    Raises:
        ValueError: If it is none.

    Examples:
        >>> header = read_header(b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n0\n1\n")
        >>> header.element("vertex").num_rows, header.length
        (2, 66)
    """
    if data[:3] != b"ply":
        raise ValueError("it does not begin with 'ply'")
    end = data.find(b"end_header")
    length = data.find(b"\n", end) + 1
    if end < 0 or length == 0:
        raise ValueError("its header has no end")
    byte_order: str | None = None
    elements: list[Element] = []
    for line in data[:end].decode("ascii", errors="replace").splitlines():
        words = line.split()
        match words:
            case ["format", order, *_]:
                byte_order = _BYTE_ORDERS.get(order)
            case ["element", name, number]:
                elements.append(Element(name, int(number)))
            case ["property", "list", count, type_, name]:
                elements[-1].properties.append(Property(name, _type(type_, byte_order), _count_type(count, byte_order)))
            case ["property", type_, name]:
                elements[-1].properties.append(Property(name, _type(type_, byte_order), None))
    if byte_order is None:
        raise ValueError("its header names no known format")
    if len({element.name for element in elements}) < len(elements):
        raise ValueError("its header announces two elements of one name")
    if len(elements) + sum(len(element.properties) for element in elements) > _MOST:
        raise ValueError(f"its header announces more than {_MOST} elements and properties")
    if any(element.num_rows > 0 and not element.properties for element in elements):
        raise ValueError("its header announces rows without properties")
    if any(element.num_rows < 0 for element in elements):
        raise ValueError("its header announces less than no rows")
    return Header(elements, byte_order, length)


def _count_type(name: str, byte_order: str | None) -> np.dtype:
    found = _type(name, byte_order)
    if found.kind == "f":
        raise ValueError(f"its header counts the values of a list as '{name}'")
    return found


def _type(name: str, byte_order: str | None) -> np.dtype:
    if name not in _TYPES:
        raise ValueError(f"its header names an unknown type '{name}'")
    return np.dtype((byte_order or "") + _TYPES[name])
