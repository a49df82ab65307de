"""Files that appear whole or not at all."""

from dnf_pyg.mesh.atomic import check_writable, write_bytes


def test_longest_name_that_a_folder_can_hold(tmp_path):
    path = tmp_path / ("ü" * 125 + ".ply")  # 254 bytes
    check_writable(path)
    write_bytes(path, b"mesh")
    assert [found.name for found in tmp_path.iterdir()] == [path.name]


def test_replaced_file_keeps_its_permissions(tmp_path):
    path = tmp_path / "private.ply"
    path.write_bytes(b"old")
    path.chmod(0o600)
    write_bytes(path, b"new")
    assert path.stat().st_mode & 0o777 == 0o600
    write_bytes(tmp_path / "new.ply", b"")
    (tmp_path / "usual").touch()
    assert (tmp_path / "new.ply").stat().st_mode == (tmp_path / "usual").stat().st_mode
