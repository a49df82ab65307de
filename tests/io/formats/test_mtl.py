from pathlib import PurePosixPath

import pytest

from dnf_pyg.io.formats.mtl import place_pictures


@pytest.mark.parametrize(
    ("line", "name", "written"),
    [
        (b"map_Kd wood.png", "wood.png", b"map_Kd oak.png"),
        (b"\tMAP_Ka -s 1 1 1 wood.png \r", "wood.png", b"\tMAP_Ka -s 1 1 1 oak.png \r"),
        (b"bump -bm 1 fine wood.png", "fine wood.png", b"bump -bm 1 oak.png"),
        (b"norm pictures\\wood.png", "pictures/wood.png", b"norm pictures\\oak.png"),
        (b"map_Kd Gr\xfcn.png", b"Gr\xfcn.png".decode(errors="surrogateescape"), b"map_Kd oak.png"),
        (b"map_Kd no such picture.png", "picture.png", b"map_Kd no such oak.png"),
    ],
)
def test_names_of_pictures(tmp_path, line, name, written):
    for path in ("wood.png", "fine wood.png", "pictures/wood.png", "Grün.png"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_bytes(b"")
    seen = []

    def place(name):
        seen.append(name)
        return "pictures/oak.png" if "/" in name else "oak.png"

    data = b"\xef\xbb\xbfnewmtl a\r\n" + line + b"\nKd 1 1 1\n# map_Kd none.png\nmap_Kd\n"
    assert place_pictures(data, tmp_path, PurePosixPath(), place) == data.replace(line, written)
    assert seen == [name]
    assert place_pictures(data, tmp_path, PurePosixPath(), lambda name: name) == data


def test_long_lines_take_no_time(tmp_path):
    blanks, words = 100_000 * b" ", 100_000 * b"a "
    data = b"map_Kd" + blanks + b"\ra\nmap_Kd " + words + b"b.png" + blanks + b"\nmap_Ks \n"
    seen = []
    assert place_pictures(data, tmp_path, PurePosixPath(), lambda name: seen.append(name) or name) == data
    assert seen == ["b.png"]


def test_names_are_relative_to_the_library_or_else_to_the_mesh(tmp_path):
    (tmp_path / "mat").mkdir()
    for path in ("mat/a.png", "b.png"):
        (tmp_path / path).write_bytes(b"")
    seen = []
    place_pictures(
        b"map_Kd a.png\nmap_Ks b.png\n", tmp_path, PurePosixPath("mat"), lambda name: seen.append(name) or name
    )
    assert seen == ["mat/a.png", "b.png"]
