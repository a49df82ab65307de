import struct

import numpy as np
import pytest

from dnf_pyg.io.formats import PlyDocument

HEADER = """ply
format {format} 1.0
comment made by hand
element camera 1
property float view
element vertex 5
property uchar red
property {real} x
property {real} y
property {real} z
property float nx
property float ny
property float nz
element face 2
property uchar label
property list uchar {corner} vertex_indices
property list uchar float texcoord
end_header
"""
POS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)]
FACES = {True: [(0, 1, 2), (0, 2, 3)], False: [(0, 1, 2, 3), (1, 4, 2)]}


def make(format_, real="float", corner="int", uniform=True):
    header = HEADER.format(format=format_, real=real, corner=corner).encode()
    codes = {"float": "f", "double": "d", "int": "i", "uint": "I", "ushort": "H"}
    if format_ == "ascii":
        rows = ["0.5"] + [f"{17 * i} {x} {y}  {z} 0 0 1" for i, (x, y, z) in enumerate(POS)]
        rows += [f"9 {len(f)} {' '.join(map(str, f))} 2 0.5 0.25" for f in FACES[uniform]]
        return header + "\n".join(rows).encode() + b"\n"
    order = "<" if "little" in format_ else ">"
    body = struct.pack(order + "f", 0.5)
    for i, point in enumerate(POS):
        body += struct.pack(order + "B3" + codes[real] + "3f", 17 * i, *point, 0, 0, 1)
    for f in FACES[uniform]:
        body += struct.pack(f"{order}BB{len(f)}{codes[corner]}B2f", 9, len(f), *f, 2, 0.5, 0.25)
    return header + body


FORMATS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("uniform", [True, False])
@pytest.mark.parametrize(("real", "corner"), [("float", "int"), ("double", "uint"), ("float", "ushort")])
def test_reads_and_moves_every_layout(tmp_path, format_, uniform, real, corner):
    data = make(format_, real, corner, uniform)
    document = PlyDocument(data, tmp_path)
    assert document.face.tolist() == ([[0, 1, 2], [0, 2, 3]] if uniform else [[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    np.testing.assert_array_equal(document.pos, POS)
    assert document.with_positions(document.pos.copy()) == data

    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    again = PlyDocument(document.with_positions(document.pos @ turn.T), tmp_path)
    np.testing.assert_allclose(again.pos, document.pos @ turn.T, atol=1e-7)
    np.testing.assert_array_equal(again.face, document.face)
    shaded = np.unique(document.face)
    np.testing.assert_allclose(again.normal[shaded], document.normal[shaded] @ turn.T, atol=1e-7)


@pytest.mark.parametrize("format_", FORMATS)
def test_keeps_every_other_byte(tmp_path, format_):
    data = make(format_)
    document = PlyDocument(data, tmp_path)
    pos = document.pos.copy()
    pos[4] += 0.5  # in no face
    written = document.with_positions(pos)
    again = PlyDocument(written, tmp_path)
    back = again.with_positions(document.pos)
    if format_ == "ascii":
        assert [line for line in written.split(b"\n") if line not in data.split(b"\n")] == [
            b"68 2.5000000000 0.5000000000  0.5000000000 0 0 1"
        ]
    else:
        assert back == data
        assert sum(a != b for a, b in zip(data, written, strict=True)) <= 12


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("cut", [5, 12, 60])
def test_truncated_file(tmp_path, format_, cut):
    with pytest.raises((ValueError, IndexError)):
        PlyDocument(make(format_)[:-cut], tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (b"element vertex 5", b"element vertex 99999999999", "announced"),
        (b"element vertex 5", b"element vertex -5", "less than no rows"),
        (b"property float x", b"property real x", "unknown type 'real'"),
        (b"property float x", b"property int x", "not of type float or double"),
        (b"property float x", b"property float t", "no vertices with x, y and z"),
        (b"1.0\n", b"2.0\n", None),
        (b"format ascii 1.0\n", b"", "no known format"),
        (b"end_header", b"end", "no end"),
        (b"ply", b"plx", "begin with 'ply'"),
    ],
)
def test_says_what_is_wrong_with_the_header(tmp_path, old, new, text):
    data = make("ascii").replace(old, new, 1)
    if text is None:
        PlyDocument(data, tmp_path)
    else:
        with pytest.raises(ValueError, match=text):
            PlyDocument(data, tmp_path)


def test_points_have_no_triangles(tmp_path):
    header = (
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    assert PlyDocument(header.encode() + b"0 0 0\n", tmp_path).face.shape == (0, 3)


STRIPS = b"""ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element tristrips 2
property list int int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
1 1 0
0 2 0
1 2 0
"""


def test_triangle_strips(tmp_path):
    strips = PlyDocument(STRIPS + b"9 0 1 2 3 -1 2 3 4 5\n5 0 1 1 2 3\n", tmp_path)
    assert strips.face.tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5], [1, 2, 3]]
    assert len(PlyDocument(STRIPS + b"2 0 1\n0\n", tmp_path).face) == 0


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("uniform", [True, False])
@pytest.mark.parametrize("first", ["normal", "list"])
def test_normals_of_faces_follow(tmp_path, format_, uniform, first):
    normal = "".join(f"property float n{axis}\n" for axis in "xyz")
    corners = "property list uchar int vertex_indices\n"
    header = f"ply\nformat {format_} 1.0\nelement vertex 5\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    header += "element face 2\n" + (normal + corners if first == "normal" else corners + normal) + "end_header\n"
    order = "<" if "little" in format_ else ">"
    data = header.encode()
    if format_ == "ascii":
        data += "".join(f"{x} {y} {z}\n" for x, y, z in POS).encode()
    else:
        data += b"".join(struct.pack(order + "3f", *point) for point in POS)
    for face in FACES[uniform]:
        rows = [(3, (0.0, 0.0, -2.0)), (None, face)]  # pointing inwards, not of unit length
        for floats, values in rows if first == "normal" else rows[::-1]:
            if format_ == "ascii":
                data += (" ".join(map(str, values if floats else (len(values), *values))) + " ").encode()
            else:
                data += struct.pack(order + "3f", *values) if floats else b""
                data += b"" if floats else struct.pack(f"{order}B{len(values)}i", len(values), *values)
        data = data[:-1] + b"\n" if format_ == "ascii" else data
    document = PlyDocument(data, tmp_path)
    assert document.with_positions(document.pos) == data
    moved = document.pos + np.array([[0], [0], [1], [1], [0]]) * [0, 0, 1]
    again = PlyDocument(document.with_positions(moved), tmp_path)
    np.testing.assert_allclose(again.pos, moved, atol=1e-9)
    np.testing.assert_array_equal(again.face, document.face)
    stored = again.body.columns(again.header.element("face"), ("nx", "ny", "nz"))
    for row, face in enumerate(FACES[uniform]):
        triangles = [moved[[face[0], face[i], face[i + 1]]] for i in range(1, len(face) - 1)]
        area = sum(np.cross(b - a, c - a) for a, b, c in triangles)
        np.testing.assert_allclose(stored[row], -area / np.linalg.norm(area), atol=1e-6)


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_texture_in_a_comment_and_byte_order_mark(tmp_path, mark):
    data = mark + make("ascii").replace(b"comment made by hand", b"comment TextureFile my wood.png\r")
    names = []
    written = PlyDocument.place_companions(data, tmp_path, lambda name: names.append(name) or "oak.png")
    assert names == ["my wood.png"]
    assert written == data.replace(b"my wood.png", b"oak.png")
    assert PlyDocument(data, tmp_path).with_positions(np.array(POS) + 1.0).startswith(mark + b"ply\n")


def test_blanks_in_a_comment_take_no_time(tmp_path):
    data = make("ascii").replace(b"comment made by hand", b"comment TextureFile" + 100_000 * b" " + b"\ra")
    assert PlyDocument.place_companions(data, tmp_path, str.upper) == data


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (b"list uchar", b"list float", "counts the values of a list"),
        (b"element face", b"element vertex", "two elements of one name"),
        (b"element face", b"element nothing 1000000000000\nelement face", "rows without properties"),
        (
            b"element face",
            b"".join(b"element e%d 0\n" % row for row in range(1000)) + b"element face",
            "more than 1000",
        ),
    ],
)
def test_headers_that_make_no_sense(tmp_path, old, new, text):
    with pytest.raises(ValueError, match=text):
        PlyDocument(make("ascii").replace(old, new), tmp_path)


def test_lists_of_negative_length_end_at_once(tmp_path):
    header = HEADER.format(format="binary_little_endian", real="float", corner="int").encode()
    header = header.replace(b"element face 2", b"element face 4000000000").replace(b"list uchar", b"list char")
    with pytest.raises(ValueError, match="list of -1 values"):
        PlyDocument(header + bytes(4 + 25 * 5) + b"\xff" * 1000, tmp_path)
