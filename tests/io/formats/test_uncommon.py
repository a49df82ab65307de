"""Files that are valid but not what most programs write: each is read, moved and written, and the rest stays."""

import base64
import json
import struct

import numpy as np
import pytest

from dnf_pyg.io import read_mesh, write_mesh

POS = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
FACE = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
MOVE = 0.25


def obj(vertex, lines=(), end="\n"):
    """Text of an obj file whose vertices are written by a pattern, with further lines between vertices and faces."""
    faces = ["f {} {} {}".format(*corners) for corners in FACE + 1]
    return end.join([*(vertex.format(*pos) for pos in POS), *lines, *faces, ""]).encode()


def ply(format_, vertex, face, body):
    lines = ["ply", f"format {format_} 1.0", *vertex, *face, "end_header\n"]
    return "\n".join(lines).encode("latin-1") + body


AXES = ["element vertex 4", *(f"property float {axis}" for axis in "xyz")]
LISTS = ["element face 4", "property list uchar int vertex_indices"]
ROWS = "".join("{} {} {}\n".format(*pos) for pos in POS)
CORNERS = "".join("3 {} {} {}\n".format(*corners) for corners in FACE)
FACET = "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n"
FACETS = [FACET.format("".join("vertex {} {} {}\n".format(*POS[corner]) for corner in corners)) for corners in FACE]


def ply_of_all_types():
    camera = ["comment caf\u00e9", "obj_info one", "element camera 1", "property list ushort double z"]
    vertex = [*AXES, "property uchar red", "property float alpha"]
    face = ["element face 4", "property list int ushort vertex_index", "property uint id", "element edge 1"]
    body = struct.pack(">H2d", 2, 3.0, 4.0)
    body += b"".join(struct.pack(">3fBf", *pos, 200, 0.5) for pos in POS)
    body += b"".join(struct.pack(">i3HI", 3, *corners, 9) for corners in FACE) + struct.pack(">i", 7)
    return ply("binary_big_endian", camera + vertex, [*face, "property int vertex1"], body)


def gltf(nodes, parts=1):
    data = POS.astype("<f4").tobytes() + FACE.astype("<u2").tobytes()
    text = "data:application/octet-stream;base64,"
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}]
    index = {"bufferView": 1, "componentType": 5123, "count": 12 // parts, "type": "SCALAR"}
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 72, "uri": text + base64.b64encode(data).decode()}],
        "bufferViews": views,
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]
        + [index | {"byteOffset": 24 // parts * part} for part in range(parts)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1 + part} for part in range(parts)]}],
        "nodes": nodes,
    }
    return json.dumps(tree).encode()


FILES = {
    "line ends of Windows, tabs, signs, exponents.obj": obj("v\t{:+.3e}\t{:+.3e} {:+.3e} ", ["g", "s off"], "\r\n"),
    "colours after the position.obj": obj("v {} {} {} 0.5 0.25 1"),
    "a weight after the position.obj": obj("v {} {} {} 1.0"),
    "curves, lines, points, empty groups.obj": obj("v {} {} {}", ["vp 0 1", "curv 0 1 1 2", "l 1 2", "p 1", "g a"]),
    "comments at the ends of lines.obj": obj("v {} {} {} # a vertex"),
    "bytes and floats mixed, a list per vertex.ply": ply(
        "ascii", [*AXES, "property uchar red", "property list uchar float weight"], LISTS,
        "".join(f"{row} 255 {'1 1.5' if i % 2 else '0'}\n" for i, row in enumerate(ROWS.splitlines())).encode()
        + CORNERS.encode(),
    ),
    "faces before vertices.ply": ply("ascii", LISTS, AXES, (CORNERS + ROWS).encode()),
    "other elements and types, most significant byte first.ply": ply_of_all_types(),
    "two solids.stl": "".join(["solid a\n", *FACETS[:2], "endsolid a\nsolid\n", *FACETS[2:], "endsolid\n"]).encode(),
    "capitals.stl": ("SOLID A\n" + "".join(FACETS).upper() + "ENDSOLID A\n").encode(),
    "colours and comments, no number of edges.off": ("COFF # a\n\n# b\n4 4\n" + "".join(
        f"{row} 255 0 0 255\n" for row in ROWS.splitlines()
    ) + CORNERS).encode(),
    "a mesh under three nodes, mirrored and stretched.gltf": gltf(
        [{"mesh": 0}, {"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0, "scale": [1, 3, 1]}]
    ),
    "two parts of one list of vertices, no scene.gltf": gltf([{"mesh": 0}], parts=2),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_is_read_moved_and_written(tmp_path, name):
    source, target = tmp_path / name, tmp_path / f"moved {name}"
    source.write_bytes(FILES[name])
    mesh = read_mesh(source)
    np.testing.assert_allclose(mesh.pos[mesh.face.t()], POS[FACE], atol=1e-6)
    write_mesh(mesh, mesh.pos + MOVE, target)
    moved = read_mesh(target)
    np.testing.assert_allclose(moved.pos[moved.face.t()], POS[FACE] + MOVE, atol=1e-6)
    write_mesh(mesh, mesh.pos, target)
    if source.suffix != ".gltf":  # its bounds are added
        assert target.read_bytes() == FILES[name]
