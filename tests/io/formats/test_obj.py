import numpy as np
import pytest

from dnf_pyg.io.formats import ObjDocument

RICH = b"""# a quad and a triangle, coloured vertices
mtllib wood.mtl
o part
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v  1.0\t1 0 0 0 1   # corner
v 0 1 0 1 1 1
v 2 0.5 1e-3 1 1 1
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
g quad
usemtl wood
s 1
f 1/1/1 2/2/1 3/3/1 4/1/1
f -4/1/1 -1/2/1 -3/3/1
"""


def test_reads_polygons_and_negative_numbers(tmp_path):
    document = ObjDocument(RICH, tmp_path)
    assert document.face.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    assert document.pos[2].tolist() == [1, 1, 0]


def test_reads_keywords_in_capitals(tmp_path):
    document, capitals = ObjDocument(RICH, tmp_path), ObjDocument(RICH.upper(), tmp_path)
    assert np.array_equal(capitals.pos, document.pos)
    assert np.array_equal(capitals.face, document.face)
    written = capitals.with_positions(2 * capitals.pos).split(b"\n")
    assert written[1:5] == [
        b"MTLLIB WOOD.MTL",
        b"O PART",
        b"V 0 0 0 1 0 0",
        b"V 2.000000000 0.000000000 0.000000000 0 1 0",
    ]
    assert b"\nMTLLIB wood.mtl\n" in ObjDocument.place_companions(RICH.upper(), tmp_path, str.lower)


def test_moves_only_what_moved(tmp_path):
    document = ObjDocument(RICH, tmp_path)
    assert document.with_positions(document.pos.copy()) == RICH
    pos = document.pos.copy()
    pos[2, 2] = 0.25
    before, after = RICH.split(b"\n"), document.with_positions(pos).split(b"\n")
    changed = [row for row, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]]
    assert changed == [5, 11]
    assert after[5] == b"v  1.000000000\t1.000000000 0.250000000 0 0 1   # corner"


def test_stored_normals_follow(tmp_path):
    document = ObjDocument(RICH, tmp_path)
    turned = document.pos @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]).T
    normal = ObjDocument(document.with_positions(turned), tmp_path).normal
    expected = ObjDocument(RICH, tmp_path).normal @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]).T
    np.testing.assert_allclose(normal, expected, atol=1e-2)


@pytest.mark.parametrize("faces", [b"f 1 2 3\n", b"f 1/1 2/1 3/1\n", b"f 1//1 2//1 3//1\n", b"f 1/1/ 2/ 3\n"])
def test_reads_every_kind_of_corner(tmp_path, faces):
    document = ObjDocument(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\n" + faces, tmp_path)
    assert document.face.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_keeps_line_ends_and_continued_lines(tmp_path, end):
    data = end.join([b"v 0 0 0", b"v 1 0 0", b"v 0 \\", b"1 0", b"f 1 2 \\", b" 3", b""])
    document = ObjDocument(data, tmp_path)
    assert document.face.tolist() == [[0, 1, 2]]
    written = document.with_positions(document.pos + 1)
    assert written == end.join(
        [
            b"v 1.0000000000 1.0000000000 1.0000000000",
            b"v 2.0000000000 1.0000000000 1.0000000000",
            b"v 1.0000000000 \\",
            b"2.0000000000 1.0000000000",
            b"f 1 2 \\",
            b" 3",
            b"",
        ]
    )


@pytest.mark.parametrize(
    ("line", "names", "written"),
    [
        (b"mtllib my wood.mtl", ["my wood.mtl"], b"mtllib OAK.mtl"),
        (b"  mtllib a.mtl  b.mtl\r", ["a.mtl", "b.mtl"], b"  mtllib OAK.mtl  OAK.mtl\r"),
        (b"mtllib below\\c.mtl", ["below\\c.mtl"], b"mtllib below\\OAK.mtl"),
    ],
)
def test_names_of_material_libraries(tmp_path, line, names, written):
    (tmp_path / "my wood.mtl").write_text("")
    seen = []

    def place(name):
        seen.append(name)
        return "below/OAK.mtl"

    assert ObjDocument.place_companions(b"v 0 0 0\n" + line + b"\n", tmp_path, place) == b"v 0 0 0\n" + written + b"\n"
    assert seen == names
    assert ObjDocument.place_companions(line, tmp_path, lambda name: name) == line
    marked = b"\xef\xbb\xbf"  # a byte-order mark before the first line
    assert ObjDocument.place_companions(marked + line, tmp_path, place) == marked + written


def test_blanks_before_a_name_take_no_time(tmp_path):
    data = b"mtllib" + 100_000 * b" " + b"\ra.mtl\nmtllib \nv 0 0 0\n"
    assert ObjDocument.place_companions(data, tmp_path, str.upper) == data


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"v 0 0\nf 1 1 1\n", "fewer than three"),
        (b"v 0 0 x\n", "could not convert"),
        (b"v 0 0 0\nf 0 1 1\n", "counts from 1"),
        (b"v 0 0 0\nvn 0 0 1\nf 1//7 1//1 1//1\n", "normal 7 of 1"),
    ],
)
def test_says_what_is_wrong(tmp_path, data, text):
    with pytest.raises(ValueError, match=text):
        ObjDocument(data, tmp_path)


def test_byte_order_mark_is_skipped_and_kept(tmp_path):
    data = b"\xef\xbb\xbfv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n"
    document = ObjDocument(data, tmp_path)
    assert document.pos.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert document.with_positions(document.pos) == data
    assert document.with_positions(document.pos + 1).startswith(
        b"\xef\xbb\xbfv 1.0000000000 1.0000000000 1.0000000000\r\n"
    )


def test_normals_that_some_faces_use_follow(tmp_path):
    data = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n"
    document = ObjDocument(data, tmp_path)
    written = ObjDocument(document.with_positions(document.pos[:, [2, 0, 1]]), tmp_path)
    np.testing.assert_allclose(written.normal, [[1, 0, 0]], atol=1e-9)
    assert document.with_positions(document.pos) == data


@pytest.mark.parametrize("stray", ["1e6 0 0", "0 0 0", "512344 5403210 312"])
def test_unused_vertices_do_not_decide_the_digits(tmp_path, stray):
    data = f"v {stray}\nv 0 0 0\nv 0.001 0 0\nv 0 0.001 0\nf 2 3 4\n".encode()
    document = ObjDocument(data, tmp_path)
    pos = document.pos.copy()
    pos[1:] += 1e-7 / 3
    written = document.with_positions(pos)
    assert written.startswith(f"v {stray}\n".encode())
    np.testing.assert_allclose(ObjDocument(written, tmp_path).pos[1:], pos[1:], atol=1e-12)


def test_coordinates_keep_the_digits_of_the_file(tmp_path):
    data = b"v 0.000001 0.000002 0\nv 0.000003 0 0\nv 100000000 0 0\nf 1 2 3\n"  # two scales in one face
    document = ObjDocument(data, tmp_path)
    moved = document.pos + np.array([0, 0, 1e-6])
    written = ObjDocument(document.with_positions(moved), tmp_path)
    np.testing.assert_allclose(written.pos, moved, rtol=0, atol=1e-9)
