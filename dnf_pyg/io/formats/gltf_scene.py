"""Positions, normals and triangles inside a glTF description and its buffers."""

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dnf_pyg.io.formats.document import Floats, Ints, UnsupportedError
from dnf_pyg.io.formats.gltf_nodes import apply_transform, mesh_transforms
from dnf_pyg.io.formats.normals import moved_normals

__all__ = ["GltfScene"]

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_COPIES = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")  # may stand beside plain data
_COMPRESSED = (*_COPIES, "KHR_mesh_quantization")
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_SHADING = {"NORMAL": 3, "TANGENT": 4}  # numbers per vertex


class GltfScene:
    """The triangles of a glTF description.

    Compressed copies beside plain data (Draco, meshopt) are dropped as soon as a vertex moves.

    Positions are those of the scene (a node's scale, turn and place applied, the first one where several nodes show a
    mesh); they are written back in the mesh's own frame.

    Args:
        tree: The description, parsed.
        buffers: Content of its buffers.

    Attributes:
        pos: Vertex positions, (V, 3).
        face: Vertices of each triangle, (F, 3).
        num_shown: Triangles that the scene shows, those of a mesh once for each of its nodes.
    """

    def __init__(self, tree: dict[str, Any], buffers: list[bytes]) -> None:
        self.tree, self.buffers = tree, buffers
        used = [name for name in self.tree.get("extensionsRequired", []) if name in _COMPRESSED]
        if used:
            raise UnsupportedError(f"it is compressed with {used[0]}", "Export it without compression.")
        transforms = mesh_transforms(self.tree)
        self.spans: dict[int, slice] = {}  # vertices by POSITION accessor
        self.transforms: dict[int, Floats] = {}
        self.shading: dict[int, dict[str, int]] = {}  # NORMAL and TANGENT accessors by POSITION accessor
        pos, face = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
        shows = Counter(node["mesh"] for node in tree.get("nodes", []) if "mesh" in node)
        num_vertices = num_faces = self.num_shown = 0
        num_bytes = sum(map(len, buffers))
        for number, mesh in enumerate(self.tree.get("meshes", [])):
            for primitive in mesh["primitives"]:
                accessor = primitive["attributes"].get("POSITION")
                if accessor is None or primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
                    continue
                if accessor not in self.spans:
                    local = self._positions(accessor)
                    self.transforms[accessor] = transforms.get(number, np.eye(4))
                    pos.append(apply_transform(self.transforms[accessor], local))
                    self.spans[accessor] = slice(num_vertices, num_vertices + len(local))
                    self.shading[accessor] = {}
                    num_vertices += len(local)
                for name, width in _SHADING.items():
                    if name in primitive["attributes"]:
                        self._check_shading(primitive["attributes"][name], width, self.spans[accessor])
                        self.shading[accessor].setdefault(name, primitive["attributes"][name])
                face.append(self._triangles(primitive, self.spans[accessor]))
                num_faces += len(face[-1])
                self.num_shown += len(face[-1]) * max(shows[number], 1)
                if max(num_vertices, num_faces) > num_bytes:
                    raise ValueError("its parts repeat the same vertices or faces too often")
        self.pos, self.face = np.concatenate(pos), np.concatenate(face)

    def _positions(self, accessor: int) -> Floats:
        entry = self.tree["accessors"][accessor]
        if entry["componentType"] != 5126 or entry["type"] != "VEC3":
            raise UnsupportedError("its positions are not plain floats", "Export it without quantization.")
        with np.errstate(invalid="ignore"):  # signalling NaN in a damaged file
            return self._view(self.buffers, accessor).astype(np.float64)

    def _check_shading(self, accessor: int, width: int, span: slice) -> None:
        stored = self._view(self.buffers, accessor)
        if stored.dtype != np.float32 or stored.shape != (span.stop - span.start, width):
            raise ValueError("its normals or tangents are not plain floats, one for each vertex")

    def _triangles(self, primitive: dict[str, Any], span: slice) -> Ints:
        corner = np.arange(span.stop - span.start)
        if "indices" in primitive:
            corner = self._view(self.buffers, primitive["indices"])[:, 0].astype(np.int64)
            names = [name for name in ("POSITION", *_SHADING) if name in primitive["attributes"]]
            if any(self._overlap(primitive["indices"], primitive["attributes"][name]) for name in names):
                raise ValueError("its vertices and faces share bytes")
        if corner.max(initial=-1) >= span.stop - span.start:
            raise ValueError(f"a face names vertex {corner.max()} of {span.stop - span.start}")
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _TRIANGLES:
            triangles = corner[: len(corner) // 3 * 3].reshape(-1, 3)
        elif mode == _FAN:
            triangles = np.stack([np.full_like(corner[2:], corner[0]), corner[1:-1], corner[2:]], axis=1)
        else:
            triangles = np.stack([corner[:-2], corner[1:-1], corner[2:]], axis=1)
            triangles[1::2] = triangles[1::2, [1, 0, 2]]
        return triangles + span.start

    def property(self, name: str) -> Floats:
        """Numbers of a vertex attribute of the application's own, (V,); glTF writes its name as ``_NAME``.

        Raises:
            KeyError: If no part of the scene has it.
            ValueError: If it has several numbers per vertex.
        """
        values = np.zeros(len(self.pos))
        found = False
        for mesh in self.tree.get("meshes", []):
            for primitive in mesh["primitives"]:
                attributes = {key.lower().lstrip("_"): accessor for key, accessor in primitive["attributes"].items()}
                accessor = attributes.get(name.lower().lstrip("_"))
                if accessor is None or primitive["attributes"].get("POSITION") not in self.spans:
                    continue
                stored = self._view(self.buffers, accessor)
                if stored.shape[1] != 1:
                    raise ValueError(f"'{name}' has {stored.shape[1]} numbers per vertex")
                values[self.spans[primitive["attributes"]["POSITION"]]] = stored[:, 0]
                found = True
        if not found:
            raise KeyError(name)
        return values

    def moved(self, pos: Floats, vertices: Ints) -> tuple[dict[str, Any], list[bytes]]:
        """Description and buffers with other positions (V, 3), of which ``vertices`` differ."""
        tree = self._without_copies() if len(vertices) else dict(self.tree)
        tree["accessors"] = [dict(entry) for entry in tree["accessors"]]
        buffers = [bytearray(buffer) for buffer in self.buffers]
        moved = np.zeros(len(pos), dtype=bool)
        moved[vertices] = True
        for accessor, span in self.spans.items():
            if not moved[span].any():
                continue
            local = self._view(buffers, accessor)
            inverse = np.linalg.inv(self.transforms[accessor]).astype(np.float64)
            local[moved[span]] = apply_transform(inverse, pos[span][moved[span]])
            tree["accessors"][accessor]["min"] = local.min(axis=0).tolist()
            tree["accessors"][accessor]["max"] = local.max(axis=0).tolist()
        self._move_normals(buffers, pos)
        return tree, [bytes(buffer) for buffer in buffers]

    def _without_copies(self) -> dict[str, Any]:
        """The description without compressed copies of the same triangles, which viewers would show instead."""

        def plain(entry: dict[str, Any]) -> dict[str, Any]:
            if not any(name in entry.get("extensions", {}) for name in _COPIES):
                return entry
            others = {name: value for name, value in entry["extensions"].items() if name not in _COPIES}
            rest = {name: value for name, value in entry.items() if name != "extensions"}
            return rest | ({"extensions": others} if others else {})

        tree = dict(self.tree)
        kept = [name for name in tree.pop("extensionsUsed", []) if name not in _COPIES]
        if kept:  # an empty list is not allowed
            tree["extensionsUsed"] = kept
        tree["bufferViews"] = [plain(view) for view in tree["bufferViews"]]
        tree["meshes"] = [
            mesh | {"primitives": [plain(primitive) for primitive in mesh["primitives"]]} for mesh in tree["meshes"]
        ]
        return tree

    def _move_normals(self, buffers: list[bytearray], pos: Floats) -> None:
        spans = {accessor: span for accessor, span in self.spans.items() if "NORMAL" in self.shading[accessor]}
        if not spans:
            return
        normal = np.zeros_like(self.pos)
        for accessor, span in spans.items():
            stored = self._view(self.buffers, self.shading[accessor]["NORMAL"]).astype(np.float64)
            normal[span] = stored @ np.linalg.inv(self.transforms[accessor])[:3, :3]  # by the inverse transpose
        shaded = np.zeros(len(self.pos), dtype=bool)
        for span in spans.values():
            shaded[span] = True
        face = self.face[shaded[self.face[:, 0]]]
        updated = moved_normals(normal, face, face, self.pos, pos)
        changed = (updated != normal).any(axis=1)
        for accessor, span in spans.items():
            names = self.shading[accessor]
            before = self._view(self.buffers, names["NORMAL"])[changed[span]].astype(np.float64)
            after = updated[span][changed[span]] @ self.transforms[accessor][:3, :3]
            after /= np.linalg.norm(after, axis=1, keepdims=True)
            self._view(buffers, names["NORMAL"])[changed[span]] = after
            if "TANGENT" in names:
                tangent = self._view(buffers, names["TANGENT"])
                tangent[changed[span], :3] = _turned(tangent[changed[span], :3], before, after)

    def _overlap(self, first: int, second: int) -> bool:
        """Whether the stretches of two accessors share bytes."""
        numbers = (self.tree["accessors"][accessor]["bufferView"] for accessor in (first, second))
        same_buffer = len({self.tree["bufferViews"][number]["buffer"] for number in numbers}) == 1
        return same_buffer and np.may_share_memory(self._view(self.buffers, first), self._view(self.buffers, second))

    def _view(self, buffers: list[Any], accessor: int) -> NDArray[Any]:
        """Values of an accessor, (N, C), as a view of its buffer."""
        entry = self.tree["accessors"][accessor]
        if "sparse" in entry:
            raise UnsupportedError("it has sparse accessors", "Export it without them.")
        view = self.tree["bufferViews"][entry["bufferView"]]
        type_ = np.dtype(_COMPONENTS[entry["componentType"]])
        width = _WIDTHS[entry["type"]]
        stride = view.get("byteStride", width * type_.itemsize)
        offset = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        count = entry["count"]
        buffer = buffers[view["buffer"]]
        needed = offset + (count - 1) * stride + width * type_.itemsize if count else 0
        if min(offset, count) < 0 or stride < width * type_.itemsize or needed > len(buffer):
            raise ValueError(f"accessor {accessor} needs {needed} bytes of a buffer of {len(buffer)}")
        return np.ndarray((count, width), type_, buffer, offset, (stride, type_.itemsize))


def _turned(vector: Floats, before: Floats, after: Floats) -> Floats:
    """Turn vectors (N, 3) by the smallest turn that takes one unit vector (N, 3) to the other."""
    axis = np.cross(before, after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    along = axis * (axis * vector).sum(axis=1, keepdims=True) / np.maximum(1 + cosine, 1e-6)
    return vector * cosine + np.cross(axis, vector) + along
