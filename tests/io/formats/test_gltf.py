import base64
import json
import struct

import numpy as np
import pytest
import trimesh

from dnf_pyg.io.formats import GlbDocument, GltfDocument

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype="<f4")
HALF_TURN = [0, 0, 0.7071067811865476, 0.7071067811865476]  # a quarter about z
POS_IN_SCENE = np.array([[5, 0, 0], [5, 2, 0], [3, 2, 0], [3, 0, 0]], dtype=float)


def make_tree(buffer):
    """A square with interleaved position, normal and tangent, shown by a scaled, turned and moved node."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "translation": [5, 0, 0]}, {"mesh": 0, "rotation": HALF_TURN, "scale": [2, 2, 2]}],
        "meshes": [
            {
                "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TANGENT": 2}, "indices": 3}],
                "extras": {"note": "kept"},
            }
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 0, "byteOffset": 24, "componentType": 5126, "count": 4, "type": "VEC4"},
            {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 160, "byteStride": 40},
            {"buffer": 0, "byteOffset": 160, "byteLength": 6},
        ],
        "buffers": [buffer],
    }


def make_buffer():
    rows = np.hstack([SQUARE, np.tile([0, 0, 1], (4, 1)), np.tile([1, 0, 0, -1], (4, 1))]).astype("<f4")
    return rows.tobytes() + bytes([0, 1, 2, 0, 2, 3]) + b"\0\0"


def make_glb():
    text = json.dumps(make_tree({"byteLength": 166})).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(make_buffer()), b"BIN\0") + make_buffer()
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def make_gltf():
    uri = "data:application/octet-stream;base64," + base64.b64encode(make_buffer()).decode()
    return json.dumps(make_tree({"byteLength": 166, "uri": uri})).encode()


CASES = pytest.mark.parametrize(("kind", "data"), [(GlbDocument, make_glb()), (GltfDocument, make_gltf())])


@CASES
def test_reads_positions_of_the_scene(tmp_path, kind, data):
    document = kind(data, tmp_path)
    np.testing.assert_allclose(document.pos, POS_IN_SCENE, atol=1e-6)
    assert document.face.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert document.with_positions(document.pos.copy()) == data


@CASES
def test_positions_bounds_normals_and_tangents_follow(tmp_path, kind, data):
    document = kind(data, tmp_path)
    turned = document.pos[:, [0, 2, 1]] * [1, -1, 1]  # a quarter about the scene's x
    scene = kind(document.with_positions(turned), tmp_path).scene
    np.testing.assert_allclose(scene.pos, turned, atol=1e-6)
    local = SQUARE[:, [2, 1, 0]] * [-1, 1, 1]
    entry = scene.tree["accessors"][0]
    np.testing.assert_allclose(entry["min"], local.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(entry["max"], local.max(axis=0), atol=1e-6)
    stored = np.frombuffer(scene.buffers[0][:160], "<f4").reshape(4, 10)
    a, b, c = stored[:3, :3]
    np.testing.assert_allclose(stored[:, 3:6], np.tile(np.cross(b - a, c - a), (4, 1)), atol=1e-6)
    np.testing.assert_allclose((stored[:, 3:6] * stored[:, 6:9]).sum(axis=1), 0, atol=1e-6)
    np.testing.assert_array_equal(stored[:, 9], -1)
    assert scene.tree["meshes"][0]["extras"] == {"note": "kept"}


def test_buffer_beside_the_file_stays_and_changes_go_inside(tmp_path):
    (tmp_path / "a b.bin").write_bytes(make_buffer())
    data = json.dumps(make_tree({"byteLength": 166, "uri": "a%20b.bin"})).encode()
    document = GltfDocument(data, tmp_path)
    names = []
    GltfDocument.place_companions(data, tmp_path, lambda name: names.append(name) or name)
    assert names == ["a b.bin"]
    written = document.with_positions(document.pos + 1)
    assert (tmp_path / "a b.bin").read_bytes() == make_buffer()
    np.testing.assert_allclose(GltfDocument(written, tmp_path / "elsewhere").pos, POS_IN_SCENE + 1, atol=1e-6)


def test_trimesh_reads_what_is_written(tmp_path):
    document = GlbDocument(make_glb(), tmp_path)
    written = document.with_positions(document.pos * 3)
    mesh = trimesh.load_mesh(trimesh.util.wrap_as_stream(written), file_type="glb", process=False)
    np.testing.assert_allclose(mesh.vertices, POS_IN_SCENE * 3, atol=1e-5)
    as_text = GltfDocument(document.as_gltf(), tmp_path)
    np.testing.assert_allclose(as_text.pos, POS_IN_SCENE, atol=1e-6)


@pytest.mark.parametrize(("mode", "faces"), [(5, [[0, 1, 2], [2, 1, 3]]), (6, [[0, 1, 2], [0, 2, 3]]), (1, [])])
def test_strips_fans_and_lines(tmp_path, mode, faces):
    tree = make_tree({"byteLength": 166, "uri": json.loads(make_gltf())["buffers"][0]["uri"]})
    primitive = tree["meshes"][0]["primitives"][0]
    del primitive["indices"]
    primitive["mode"] = mode
    assert GltfDocument(json.dumps(tree).encode(), tmp_path).face.tolist() == faces


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed with KHR_draco"),
        ({"buffers": [{"byteLength": 166, "uri": "absent.bin"}]}, "does not exist"),
        ({"buffers": [{"byteLength": 8, "uri": "data:;base64,AAAA"}]}, "needs 132 bytes of a buffer of 3"),
    ],
)
def test_says_what_is_wrong(tmp_path, change, text):
    tree = {**json.loads(make_gltf()), **change}
    with pytest.raises(ValueError, match=text):
        GltfDocument(json.dumps(tree).encode(), tmp_path)


def test_truncated_glb(tmp_path):
    for data in (make_glb()[:-9], b"glTF", b"glTG" + make_glb()[4:]):
        with pytest.raises(ValueError, match=r"announced|begin with"):
            GlbDocument(data, tmp_path)


@pytest.mark.parametrize("place", ["primitive", "view"])
def test_compressed_copies_are_dropped_with_the_first_move(tmp_path, place):
    tree = json.loads(make_gltf())
    name = "KHR_draco_mesh_compression" if place == "primitive" else "EXT_meshopt_compression"
    entry = tree["meshes"][0]["primitives"][0] if place == "primitive" else tree["bufferViews"][0]
    entry["extensions"] = {name: {"bufferView": 1}, "OTHER_kept": {}}
    tree["extensionsUsed"] = [name, "OTHER_kept"]
    data = json.dumps(tree).encode()
    document = GltfDocument(data, tmp_path)
    assert document.with_positions(document.pos) == data
    written = json.loads(document.with_positions(document.pos + 1))
    entry = written["meshes"][0]["primitives"][0] if place == "primitive" else written["bufferViews"][0]
    assert entry["extensions"] == {"OTHER_kept": {}}
    assert written["extensionsUsed"] == ["OTHER_kept"]


def change(tree, kind):
    accessors, view = tree["accessors"], tree["bufferViews"][0]
    match kind:
        case "count":
            accessors[0]["count"] = 4_000_000_000
        case "stride of nothing":
            view["byteStride"] = 0
            accessors[0]["count"] = 4_000_000_000
        case "offset":
            accessors[0]["byteOffset"] = -12
        case "sparse":
            accessors[3]["sparse"] = {"count": 1}
        case "quantized normal":
            accessors[1]["componentType"] = 5120
        case "another number of normals":
            accessors[1]["count"] = 3
        case "repeated":
            tree["meshes"][0]["primitives"] *= 200
        case "no data":
            tree["buffers"].append({"byteLength": 8, "extensions": {"EXT_meshopt_compression": {"fallback": True}}})


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("count", "needs 159999999972 bytes"),
        ("stride of nothing", "needs 12 bytes of a buffer of 168"),
        ("offset", "needs"),
        ("sparse", "sparse accessors"),
        ("quantized normal", "not plain floats"),
        ("another number of normals", "one for each vertex"),
        ("repeated", "too often"),
        ("no data", "has no data"),
    ],
)
def test_descriptions_that_ask_for_too_much(tmp_path, kind, text):
    tree = json.loads(make_gltf())
    change(tree, kind)
    with pytest.raises(ValueError, match=text):
        GltfDocument(json.dumps(tree).encode(), tmp_path)


@pytest.mark.parametrize("names", [["a.bin", "a.bin"], ["a.bin", "%61.bin"], ["a.bin", "below/../a.bin"]])
def test_a_file_is_one_buffer(tmp_path, names):
    (tmp_path / "a.bin").write_bytes(make_buffer())
    tree = make_tree({"byteLength": 166, "uri": "a.bin"})
    tree["buffers"] = [{"byteLength": 166, "uri": name} for name in names]
    with pytest.raises(ValueError, match=r"two of its buffers are the file"):
        GltfDocument(json.dumps(tree).encode(), tmp_path)


def test_deep_and_circular_trees(tmp_path):
    tree = json.loads(make_gltf())
    tree["nodes"] = [{"children": [number + 1]} for number in range(900)] + [{"children": [0], "mesh": 0}]
    document = GltfDocument(json.dumps(tree).encode(), tmp_path)
    np.testing.assert_allclose(document.pos, SQUARE, atol=1e-6)
    tree["extras"] = json.loads("[" * 300 + "]" * 300)
    document = GltfDocument(json.dumps(tree).encode(), tmp_path)
    again = GltfDocument(document.with_positions(document.pos + 1), tmp_path)
    np.testing.assert_allclose(again.pos, SQUARE + 1, atol=1e-6)
    tree["nodes"] = [{"children": [number + 1]} for number in range(2000)] + [{"mesh": 0}]
    with pytest.raises(ValueError, match="more than 1000 deep"):
        GltfDocument(json.dumps(tree).encode(), tmp_path)
