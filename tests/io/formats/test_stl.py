import numpy as np
import pytest
import trimesh

from dnf_pyg.io.formats import StlDocument

BOX = trimesh.creation.box()
TEXT = BOX.export(file_type="stl_ascii").encode()
BINARY = b"made by hand".ljust(80) + BOX.export(file_type="stl")[80:-2] + b"\x34\x12"  # a colour in the last triangle


@pytest.mark.parametrize("data", [TEXT, BINARY], ids=["ascii", "binary"])
def test_triangles_and_their_normals_move(tmp_path, data):
    document = StlDocument(data, tmp_path)
    np.testing.assert_allclose(document.pos.reshape(-1, 3, 3), BOX.triangles)
    assert document.with_positions(document.pos.copy()) == data
    turned = document.with_positions(document.pos[:, [1, 2, 0]])
    again = trimesh.load_mesh(trimesh.util.wrap_as_stream(turned), file_type="stl", process=False)
    np.testing.assert_allclose(again.triangles, BOX.triangles[..., [1, 2, 0]], atol=1e-7)
    stored = turned[84:][:12] if data is BINARY else None
    if stored is not None:
        np.testing.assert_allclose(np.frombuffer(stored, "<f4"), BOX.face_normals[0][[1, 2, 0]], atol=1e-6)
        assert turned[:84] == data[:84]
        assert turned[-2:] == b"\x34\x12"
    else:
        assert turned.split(b"\n")[0] == data.split(b"\n")[0]
        assert b"facet normal" in turned


@pytest.mark.parametrize("data", [TEXT, BINARY], ids=["ascii", "binary"])
def test_only_moved_triangles_change(tmp_path, data):
    document = StlDocument(data, tmp_path)
    pos = document.pos.copy()
    pos[4] += 0.125
    back = StlDocument(document.with_positions(pos), tmp_path)
    np.testing.assert_array_equal(back.moved(document.pos), [4])


@pytest.mark.parametrize("data", [TEXT[:-60], BINARY[:-7], b"solid\x00nothing", b"x" * 100])
def test_truncated_or_foreign_file(tmp_path, data):
    with pytest.raises(ValueError, match=r"ends in the middle|announced"):
        StlDocument(data, tmp_path)


def test_binary_file_that_begins_like_text(tmp_path):
    assert len(StlDocument(b"solid" + BINARY[5:], tmp_path).face) == 12


def test_count_of_zero_before_triangles_is_named(tmp_path):
    with pytest.raises(ValueError, match="announces 0 triangles, but 12 follow"):
        StlDocument(BINARY[:80] + bytes(4) + BINARY[84:], tmp_path)
    assert len(StlDocument(BINARY[:80] + bytes(4), tmp_path).face) == 0


def test_byte_order_mark(tmp_path):
    document = StlDocument(b"\xef\xbb\xbf" + TEXT, tmp_path)
    assert document.with_positions(document.pos + 1).startswith(b"\xef\xbb\xbfsolid")
    in_header = StlDocument(b"\xef\xbb\xbf" + BINARY[3:], tmp_path)  # bytes like any others there
    assert len(in_header.with_positions(in_header.pos + 1)) == len(BINARY)
