import pytest

from dnf_pyg.errors import OutputError
from dnf_pyg.io.atomic import check_writable, write_bytes, write_files


def test_files_that_belong_together_appear_all_or_none(tmp_path):
    kept = tmp_path / "kept.obj"
    kept.write_bytes(b"before")
    with pytest.raises(OutputError, match=r"writable folder for '.*absent/b.mtl' \(got No such file or directory\)"):
        write_files({kept: b"after", tmp_path / "absent" / "b.mtl": b"more"})
    assert [path.name for path in tmp_path.iterdir()] == ["kept.obj"]
    assert kept.read_bytes() == b"before"
    write_files({kept: b"after", tmp_path / "b.mtl": b"more"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"kept.obj": b"after", "b.mtl": b"more"}


def test_new_files_have_the_permissions_of_new_files(tmp_path):
    (tmp_path / "ordinary").write_bytes(b"")
    write_bytes(tmp_path / "written", b"")
    assert (tmp_path / "written").stat().st_mode == (tmp_path / "ordinary").stat().st_mode


def test_a_folder_in_the_way_is_told(tmp_path):
    (tmp_path / "out.obj").mkdir()
    with pytest.raises(OutputError, match=r"Expected to be able to write '.*out.obj' \(got Is a directory\)"):
        write_bytes(tmp_path / "out.obj", b"data")
    assert [path.name for path in tmp_path.iterdir()] == ["out.obj"]


def test_the_check_leaves_nothing(tmp_path):
    check_writable(tmp_path / "out.obj")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="Create it or choose another"):
        check_writable(tmp_path / "absent" / "out.obj")


@pytest.mark.parametrize("dangling", [False, True])
def test_a_link_is_written_through(tmp_path, dangling):
    (tmp_path / "real").mkdir()
    if not dangling:
        (tmp_path / "real" / "a.obj").write_bytes(b"before")
    (tmp_path / "link.obj").symlink_to("real/a.obj")
    write_bytes(tmp_path / "link.obj", b"after")
    assert (tmp_path / "link.obj").is_symlink()
    assert (tmp_path / "real" / "a.obj").read_bytes() == b"after"
    assert [path.name for path in (tmp_path / "real").iterdir()] == ["a.obj"]


def test_links_in_a_circle_and_to_absent_folders(tmp_path):
    (tmp_path / "circle.obj").symlink_to("circle.obj")
    (tmp_path / "lost.obj").symlink_to("absent/a.obj")
    for name, reason in (("circle.obj", "Too many levels"), ("lost.obj", "No such file")):
        for write in (check_writable, lambda path: write_bytes(path, b"")):
            with pytest.raises(OutputError, match=reason):
                write(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["circle.obj", "lost.obj"]


def test_new_files_replace_nothing_and_take_their_folders_away_again(tmp_path):
    taken, fresh = tmp_path / "taken.mtl", tmp_path / "below" / "deeper" / "fresh.mtl"
    taken.write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        write_files({fresh: b"a", taken: b"b", tmp_path / "a.obj": b"c"}, new={fresh, taken})
    assert [path.name for path in tmp_path.iterdir()] == ["taken.mtl"]
    assert taken.read_bytes() == b"mine"
    write_files({fresh: b"a", tmp_path / "a.obj": b"c"}, new={fresh})
    assert fresh.read_bytes() == b"a"


def test_file_that_a_program_has_open_is_told(tmp_path, monkeypatch):
    """As Windows does it, which refuses to replace such a file."""
    (tmp_path / "open.ply").write_bytes(b"before")

    def replace(source, target):
        raise PermissionError(13, "The process cannot access the file")

    monkeypatch.setattr("os.replace", replace)
    with pytest.raises(OutputError, match=r"open.ply' \(got The process .*\)\. Close the programs that have it open"):
        write_bytes(tmp_path / "open.ply", b"after")
    assert [path.name for path in tmp_path.iterdir()] == ["open.ply"]
