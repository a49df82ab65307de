import numpy as np
import pytest

from dnf_pyg.io.formats import OffDocument

RICH = b"""COFF # coloured
# vertices, faces, edges
5 2 0

0 0 0 255 0 0 255
1 0 0 255 0 0 255
1 1 0 255 0 0 255
0 1 0 255 0 0 255
2 0 0 255 0 0 255
4 0 1 2 3 0.5 0.5 0.5
3 1 4 2
"""


def test_reads_and_moves(tmp_path):
    document = OffDocument(RICH, tmp_path)
    assert document.face.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    pos = document.pos.copy()
    pos[1] = (1, 0.5, 0)
    expected = RICH.replace(b"1 0 0 255", b"1.000000000 0.500000000 0.000000000 255", 1)
    assert document.with_positions(pos) == expected


def test_header_on_one_line_and_absent(tmp_path):
    for header in (b"OFF 3 1 0\n", b"3 1 0\n", b"OFF\n3 1\n"):
        document = OffDocument(header + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", tmp_path)
        np.testing.assert_array_equal(document.face, [[0, 1, 2]])


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"4OFF\n1 0 0\n0 0 0 0\n", "plain vertices"),
        (b"OFF BINARY\n1 0 0\n", "plain vertices"),
        (RICH[:-20], "announced"),
        (b"OFF\n1 1 0\n0 0 0\n3 0 0\n", "fewer corners"),
        (b"OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3000000000 0 1 2\n-2999999997\n", "fewer corners"),
        (b"OFF\n3 4 0\n0 0 0\n1 0 0\n0 1 0\n" + 4 * b"4611686018427387904\n", "fewer corners"),  # 0 in 64 bits
    ],
)
def test_says_what_is_wrong(tmp_path, data, text):
    with pytest.raises(ValueError, match=text):
        OffDocument(data, tmp_path)


def test_header_and_numbers_on_one_line_without_a_blank(tmp_path):
    data = b"OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    document = OffDocument(data, tmp_path)
    assert document.face.tolist() == [[0, 1, 2]]
    assert document.with_positions(document.pos + 1).startswith(b"OFF3 1 0\n1.000")


def test_stored_normals_follow(tmp_path):
    data = b"NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n"
    document = OffDocument(data, tmp_path)
    assert document.with_positions(document.pos) == data
    turned = OffDocument(document.with_positions(document.pos[:, [2, 0, 1]]), tmp_path)
    np.testing.assert_allclose(turned.pos, document.pos[:, [2, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(turned.normal, np.tile([1, 0, 0], (3, 1)), atol=1e-9)
    with pytest.raises(ValueError, match="fewer than 6 numbers"):
        OffDocument(data.replace(b"0 0 0 0 0 1", b"0 0 0 0 0"), tmp_path)


def test_unused_vertices_do_not_decide_the_digits(tmp_path):
    document = OffDocument(b"OFF\n4 1 0\n0 0 0\n.01 0 0\n0 .01 0\n1e9 0 0\n3 0 1 2\n", tmp_path)
    pos = document.pos * [[2], [2], [2], [1]]
    written = OffDocument(document.with_positions(pos), tmp_path)
    np.testing.assert_allclose(written.pos[:3], pos[:3], atol=1e-11)
    assert b"\n1e9 0 0\n" in document.with_positions(pos)
