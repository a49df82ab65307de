import pytest

from dnf_pyg.benchmark import find_test_folder
from dnf_pyg.errors import DataError
from dnf_pyg.mesh.pairs import pair_meshes


def touch(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_text("")


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
