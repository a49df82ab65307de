import pytest

from dnf_pyg.datasets.pairing import find_test_folder, pair_meshes
from dnf_pyg.errors import DataError


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


@pytest.mark.parametrize("above", [0, 1, 2])
def test_folder_is_found_from_above(test_set, above):
    assert find_test_folder([test_set, *test_set.parents][above]) == test_set.resolve()


def test_several_test_folders_are_named(tmp_path):
    for subset in ("one", "two"):
        touch(tmp_path / subset / "test" / "original")
        touch(tmp_path / subset / "test" / "noisy")
    with pytest.raises(DataError, match=r"one/test, .*two/test"):
        find_test_folder(tmp_path)


def test_real_benchmark(cnr_root):
    pairs = pair_meshes(find_test_folder(cnr_root))
    assert len(pairs) == 36
    assert len({clean for _, clean in pairs}) == 12
