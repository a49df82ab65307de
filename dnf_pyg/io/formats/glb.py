"""glTF 2.0 as one binary file."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dnf_pyg.io.formats.document import Floats
from dnf_pyg.io.formats.gltf import GltfDocument, gltf_text, load_buffers, parse_tree, place_uris
from dnf_pyg.io.formats.gltf_scene import GltfScene

__all__ = ["GlbDocument", "glb_bytes"]

_HEADER = struct.Struct("<4sII")  # magic, version, length
_CHUNK = struct.Struct("<II")  # length, kind
_JSON = int.from_bytes(b"JSON", "little")
_BIN = int.from_bytes(b"BIN\0", "little")


class GlbDocument(GltfDocument):
    """A glb file: positions of all triangles move, their bounds, normals and tangents follow, all else stays."""

    def _read_scene(self) -> GltfScene:
        self.chunks = _read_chunks(self.data)
        tree = parse_tree(next((chunk for kind, chunk in self.chunks if kind == _JSON), b""))
        entries = tree.get("buffers", [])
        self.has_inside = bool(entries) and "uri" not in entries[0]  # the first buffer is the binary chunk
        buffers = [next((chunk for kind, chunk in self.chunks if kind == _BIN), b"")] if self.has_inside else []
        return GltfScene(tree, buffers + load_buffers(entries[len(buffers) :], self.folder))

    def as_gltf(self) -> bytes:
        """Write the same as the text of a gltf file."""
        return gltf_text(self.scene.tree, dict(enumerate(self.scene.buffers)))

    @classmethod
    def place_companions(cls, data: bytes, folder: Path, place: Callable[[str], str]) -> bytes:
        """Replace the names of pictures and buffers beside the file."""
        chunks = _read_chunks(data)
        tree = parse_tree(next(chunk for kind, chunk in chunks if kind == _JSON))
        return _joined(chunks, {_JSON: gltf_text(tree, {})}) if place_uris(tree, place) else data

    def _rewritten(self, pos: Floats) -> bytes:
        tree, buffers = self.scene.moved(pos, self.moved(pos))
        start = int(self.has_inside)
        changed = [i for i, before in enumerate(self.scene.buffers) if before != buffers[i] and i >= start]
        replaced = {_JSON: gltf_text(tree, {i: buffers[i] for i in changed})}
        if self.has_inside:
            replaced[_BIN] = buffers[0]
        return _joined(self.chunks, replaced)


def glb_bytes(tree: dict[str, Any], buffers: list[bytes]) -> bytes:
    """Write a description with its buffers as one binary file: the first as it is, others as text."""
    entries = [dict(entry) for entry in tree.get("buffers", [])]
    for entry in entries[:1]:
        entry.pop("uri", None)
    text = gltf_text({**tree, "buffers": entries} if entries else tree, dict(list(enumerate(buffers))[1:]))
    return _joined([(_JSON, text), *((_BIN, buffer) for buffer in buffers[:1])], {})


def _joined(chunks: list[tuple[int, bytes]], replaced: dict[int, bytes]) -> bytes:
    """Write chunks, some of them with other content, each padded to a multiple of four bytes."""
    replaced = dict(replaced)  # the first chunk of each kind counts
    parts = []
    for kind, chunk in chunks:
        content = replaced.pop(kind, chunk)
        content += (b" " if kind == _JSON else b"\0") * (-len(content) % 4)
        parts += [_CHUNK.pack(len(content), kind), content]
    return _HEADER.pack(b"glTF", 2, _HEADER.size + sum(map(len, parts))) + b"".join(parts)


def _read_chunks(data: bytes) -> list[tuple[int, bytes]]:
    """Kind and content of the chunks of a glb file."""
    if len(data) < _HEADER.size or data[:4] != b"glTF":
        raise ValueError("it does not begin with 'glTF'")
    _, version, length = _HEADER.unpack_from(data)
    if version != 2 or length > len(data):
        raise ValueError(f"version {version} and {length} bytes announced, 2 needed and {len(data)} found")
    chunks = []
    place = _HEADER.size
    while place + _CHUNK.size <= length:
        size, kind = _CHUNK.unpack_from(data, place)
        place += _CHUNK.size
        if place + size > length:
            raise ValueError(f"a chunk of {size} bytes announced, it ends before")
        chunks.append((kind, data[place : place + size]))
        place += size
    return chunks
