"""glTF 2.0 as text, with buffers beside it or inside."""

import base64
import copy
import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from dnf_pyg.io.formats.document import Document, Floats
from dnf_pyg.io.formats.gltf_scene import GltfScene

__all__ = ["GltfDocument", "gltf_text", "load_uri", "uris_beside"]

_DATA_URI = "data:application/octet-stream;base64,"


class GltfDocument(Document):
    """A gltf file: positions of all triangles move, their bounds, normals and tangents follow, all else stays.

    Buffers beside the file that change are put into it, so that those of the original stay.
    """

    def __init__(self, data: bytes, folder: Path) -> None:
        super().__init__(data, folder)
        tree = json.loads(data.decode("utf-8-sig"))
        if not isinstance(tree, dict):
            raise ValueError("JSON, but no glTF")
        self.scene = GltfScene(tree, [load_uri(buffer.get("uri", ""), folder) for buffer in tree.get("buffers", [])])
        self.pos, self.face = self.scene.pos, self.scene.face

    def companions(self) -> list[str]:
        """Textures and buffers beside the file."""
        return uris_beside(self.scene.tree, "images") + uris_beside(self.scene.tree, "buffers")

    def property(self, name: str) -> Floats:
        """Numbers of a vertex attribute, (V,): ``_NAME`` in the file, 0 where a part of the scene has none."""
        return self.scene.property(name)

    def _rewritten(self, pos: Floats) -> bytes:
        tree, buffers = self.scene.moved(pos, self.moved(pos))
        changed = [i for i, before in enumerate(self.scene.buffers) if before != buffers[i]]
        return gltf_text(tree, {i: buffers[i] for i in changed})


def gltf_text(tree: dict[str, Any], inside: dict[int, bytes]) -> bytes:
    """Write a description with some of its buffers, by number, put into it."""
    tree = copy.deepcopy(tree)
    for number, data in inside.items():
        tree["buffers"][number]["uri"] = _DATA_URI + base64.b64encode(data).decode()
    return json.dumps(tree, separators=(",", ":"), ensure_ascii=False).encode()


def uris_beside(tree: dict[str, Any], kind: str) -> list[str]:
    """Names of the files that "images" or "buffers" of a description lie in.

    Examples:
        >>> uris_beside({"images": [{"uri": "a%20b.png"}, {"uri": "data:,"}, {"bufferView": 3}]}, "images")
        ['a b.png']
    """
    uris = [entry.get("uri", "data:") for entry in tree.get(kind, [])]
    return [unquote(uri) for uri in uris if not uri.startswith("data:")]


def load_uri(uri: str, folder: Path) -> bytes:
    r"""Read a buffer: from the text itself, or from a file beside it.

    Raises:
        ValueError: If it does not exist.

    Examples:
        >>> load_uri("data:application/octet-stream;base64,AAEC", Path())
        b'\x00\x01\x02'
    """
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    path = folder / unquote(uri)
    if not uri or not path.is_file():
        raise ValueError(f"its buffer '{path}' does not exist")
    return path.read_bytes()
