"""glTF 2.0 as text, with buffers beside it or inside."""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from dnf_pyg.io.folder import CompanionError, find_beside
from dnf_pyg.io.formats.document import Document, Floats, UnsupportedError
from dnf_pyg.io.formats.gltf_scene import GltfScene
from dnf_pyg.io.formats.text import check_text

__all__ = ["GltfDocument", "gltf_text", "load_buffers", "parse_tree", "place_uris"]

_DATA_URI = "data:application/octet-stream;base64,"


class GltfDocument(Document):
    """A gltf file: positions of all triangles move, their bounds, normals and tangents follow, all else stays.

    Buffers beside the file that change are put into it, so that those of the original stay.
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        self.scene = self._read_scene()
        self.pos, self.face = self.scene.pos, self.scene.face

    def _read_scene(self) -> GltfScene:
        check_text(self.data[:1000])
        tree = parse_tree(self.data)
        return GltfScene(tree, load_buffers(tree.get("buffers", []), self.folder))

    def property(self, name: str) -> Floats:
        """Numbers of a vertex attribute, (V,): ``_NAME`` in the file, 0 where a part of the scene has none."""
        return self.scene.property(name)

    @classmethod
    def place_companions(cls, data: bytes, folder: Path, place: Callable[[str], str]) -> bytes:
        """Replace the names of pictures and buffers beside the file."""
        tree = parse_tree(data)
        return gltf_text(tree, {}) if place_uris(tree, place) else data

    def _rewritten(self, pos: Floats) -> bytes:
        tree, buffers = self.scene.moved(pos, self.moved(pos))
        changed = [i for i, before in enumerate(self.scene.buffers) if before != buffers[i]]
        return gltf_text(tree, {i: buffers[i] for i in changed})


def parse_tree(data: bytes) -> dict[str, Any]:
    """Parse a description.

    Raises:
        ValueError: If it is no JSON, or not that of glTF.
    """
    tree = json.loads(data.decode("utf-8-sig"))
    if not isinstance(tree, dict):
        raise ValueError("it is JSON, but not glTF")
    return tree


def gltf_text(tree: dict[str, Any], inside: dict[int, bytes]) -> bytes:
    """Write a description with some of its buffers, by number, put into it."""
    if inside:
        buffers = [dict(entry) for entry in tree["buffers"]]
        for number, data in inside.items():
            buffers[number]["uri"] = _DATA_URI + base64.b64encode(data).decode()
        tree = {**tree, "buffers": buffers}
    return json.dumps(tree, separators=(",", ":"), ensure_ascii=False).encode(errors="backslashreplace")


def place_uris(tree: dict[str, Any], place: Callable[[str], str]) -> bool:
    """Replace the names of files that a description refers to, in place; tell whether any has changed.

    Examples:
        >>> tree = {"images": [{"uri": "a%20b.png"}, {"uri": "data:,"}, {"bufferView": 3}]}
        >>> place_uris(tree, lambda name: name.replace("a b", "c d"))
        True
        >>> tree["images"][0]
        {'uri': 'c%20d.png'}
    """
    changed = False
    for entry in [*tree.get("images", []), *tree.get("buffers", [])]:
        uri = entry.get("uri", "data:")
        if not uri.startswith("data:"):
            name = unquote(uri)
            new = place(name)
            if new != name:
                entry["uri"] = quote(new)
                changed = True
    return changed


def load_buffers(entries: list[dict[str, Any]], folder: Path) -> list[bytes]:
    r"""Read buffers: from the text itself, or from files in or below the folder of the mesh.

    Raises:
        UnsupportedError: If one has no data, or its file cannot be read.
        ValueError: If two are one file: a short text could name a large file many times.

    Examples:
        >>> load_buffers([{"uri": "data:application/octet-stream;base64,AAEC"}], Path())
        [b'\x00\x01\x02']
    """
    buffers: list[bytes] = []
    files: set[Path] = set()
    for uri in (entry.get("uri") for entry in entries):
        if uri is None:
            reason = "one of its buffers has no data, as with compression"
            raise UnsupportedError(reason, "Export it without compression.")
        if uri.startswith("data:"):
            buffers.append(base64.b64decode(uri.split(",", 1)[1]))
            continue
        try:
            file = find_beside(folder, unquote(uri)).resolve()
        except CompanionError as error:
            raise UnsupportedError(
                f"its buffer {uri!r} cannot be read, since {error}",
                "Put it beside the mesh and refer to it by its name.",
            ) from error
        if file in files:
            raise ValueError(f"two of its buffers are the file {uri!r}")
        files.add(file)
        buffers.append(file.read_bytes())
    return buffers
