"""glTF 2.0 as one binary file."""

import copy
import json
import struct
from pathlib import Path
from typing import Any

from dnf_pyg.io.formats.document import Document, Floats
from dnf_pyg.io.formats.gltf import gltf_text, load_uri, uris_beside
from dnf_pyg.io.formats.gltf_scene import GltfScene

__all__ = ["GlbDocument", "glb_bytes"]

_HEADER = struct.Struct("<4sII")  # magic, version, length
_CHUNK = struct.Struct("<II")  # length, kind
_JSON = int.from_bytes(b"JSON", "little")
_BIN = int.from_bytes(b"BIN\0", "little")


class GlbDocument(Document):
    """A glb file: positions of all triangles move, their bounds, normals and tangents follow, all else stays."""

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        self.chunks = _read_chunks(data)
        inside = next((chunk for kind, chunk in self.chunks if kind == _BIN), b"")
        tree = json.loads(next((chunk for kind, chunk in self.chunks if kind == _JSON), b""))
        entries = tree.get("buffers", [])
        self.inside = next((i for i, entry in enumerate(entries) if "uri" not in entry), None)  # number of that buffer
        buffers = [load_uri(entry["uri"], folder) if "uri" in entry else inside for entry in entries]
        self.scene = GltfScene(tree, buffers)
        self.pos, self.face = self.scene.pos, self.scene.face

    def companions(self) -> list[str]:
        """Textures and buffers beside the file."""
        return uris_beside(self.scene.tree, "images") + uris_beside(self.scene.tree, "buffers")

    def as_gltf(self) -> bytes:
        """Write the same as the text of a gltf file."""
        return gltf_text(self.scene.tree, dict(enumerate(self.scene.buffers)))

    def property(self, name: str) -> Floats:
        """Numbers of a vertex attribute, (V,): ``_NAME`` in the file, 0 where a part of the scene has none."""
        return self.scene.property(name)

    def _rewritten(self, pos: Floats) -> bytes:
        tree, buffers = self.scene.moved(pos, self.moved(pos))
        changed = [i for i, before in enumerate(self.scene.buffers) if before != buffers[i] and i != self.inside]
        text = gltf_text(tree, {i: buffers[i] for i in changed})
        replaced = {_JSON: text + b" " * (-len(text) % 4)}
        if self.inside is not None:
            replaced[_BIN] = buffers[self.inside]
        return _joined([(kind, replaced.get(kind, chunk)) for kind, chunk in self.chunks])


def glb_bytes(tree: dict[str, Any], buffers: list[bytes]) -> bytes:
    """Write a description with its buffers as one binary file: the first as it is, others as text."""
    tree = copy.deepcopy(tree)
    for entry in tree.get("buffers", [])[:1]:
        entry.pop("uri", None)
    text = gltf_text(tree, dict(list(enumerate(buffers))[1:]))
    chunks = [(_JSON, text + b" " * (-len(text) % 4))]
    chunks += [(_BIN, buffer + bytes(-len(buffer) % 4)) for buffer in buffers[:1]]
    return _joined(chunks)


def _joined(chunks: list[tuple[int, bytes]]) -> bytes:
    joined = b"".join(_CHUNK.pack(len(chunk), kind) + chunk for kind, chunk in chunks)
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(joined)) + joined


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
