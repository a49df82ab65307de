import pytest

from dnf_pyg.commands.outputs import check_output
from dnf_pyg.errors import OutputError


def test_new_and_overwritten_files(tmp_path):
    check_output(tmp_path / "a.OBJ", overwrite=False)
    (tmp_path / "a.png").touch()
    check_output(tmp_path / "a.png", overwrite=True, suffixes=(".png",))
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.ply", r"new output file \(got '.*a.ply', which exists\). Add --overwrite to replace it."),
        ("a.txt", r"output ending in .obj, .ply, .* \(got '.*a.txt'\). Choose one of these endings."),
        ("absent/a.ply", "writable folder"),
    ],
)
def test_refused(tmp_path, name, text):
    (tmp_path / "a.ply").touch()
    with pytest.raises(OutputError, match=text):
        check_output(tmp_path / name, overwrite=False)
