import pytest

from dnf_pyg.errors import DataError
from dnf_pyg.mesh.pairs import pair_meshes


def touch(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_text("")


def test_noisy_meshes_belong_to_the_longest_clean_name(tmp_path):
    touch(tmp_path / "original", "bunny.obj", "bunny_hi.ply", "notes.txt")
    touch(tmp_path / "noisy", "bunny_n1.obj", "bunny_hi_n1.obj", "bunny_hi_noisy.stl", "cat_n1.obj", "bunny_n1.txt")
    assert [(noisy.name, clean.name) for noisy, clean in pair_meshes(tmp_path)] == [
        ("bunny_hi_n1.obj", "bunny_hi.ply"),
        ("bunny_hi_noisy.stl", "bunny_hi.ply"),
        ("bunny_n1.obj", "bunny.obj"),
    ]


def test_no_pair(tmp_path):
    touch(tmp_path / "original", "cat.obj")
    touch(tmp_path / "noisy", "dog_n1.obj")
    with pytest.raises(DataError, match="no such pair"):
        pair_meshes(tmp_path)
