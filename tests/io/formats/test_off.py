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
    ],
)
def test_says_what_is_wrong(tmp_path, data, text):
    with pytest.raises(ValueError, match=text):
        OffDocument(data, tmp_path)
