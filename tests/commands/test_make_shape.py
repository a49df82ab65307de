import pytest

from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh


@pytest.mark.parametrize("kind", ["blob", "simple"])
def test_number_of_faces_is_kept_within_a_tenth_and_told(kind, tmp_path, capsys):
    assert main(["make-shape", kind, "-o", str(tmp_path / "a.ply"), "--faces", "3000", "--seed", "2"]) == 0
    num_faces = read_mesh(tmp_path / "a.ply").face.size(1)
    assert num_faces == pytest.approx(3000, rel=0.1)
    assert capsys.readouterr().out == f"{tmp_path / 'a.ply'}: {num_faces} faces\n"
