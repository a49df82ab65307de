from pathlib import Path

import pytest

from dnf_pyg.datasets.pairing import (
    cnr_pairs,
    find_pairs,
    find_test_folder,
    list_meshes,
    pair_meshes,
    split_pairs,
)
from dnf_pyg.errors import DataError

PATTERN = r"(.+)_n\d+"


def touch(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_text("")


def names(pairs):
    return [(noisy.name, clean.name) for noisy, clean in pairs]


def test_lists_meshes_by_name(tmp_path):
    touch(tmp_path, "b.OBJ", "a.ply", "notes.txt")
    assert [path.name for path in list_meshes(tmp_path)] == ["a.ply", "b.OBJ"]
    assert [path.name for path in list_meshes(tmp_path, ["b"])] == ["b.OBJ"]
    with pytest.raises(DataError, match=r"got none named \['c'\]\). Check the folder"):
        list_meshes(tmp_path, ["a", "c"])
    touch(tmp_path / "empty")
    with pytest.raises(DataError, match="got none named anything"):
        list_meshes(tmp_path / "empty")


@pytest.mark.parametrize("folders", [("noisy", "clean"), ("both", "both")])
def test_pairs_by_pattern(tmp_path, folders):
    touch(tmp_path / folders[0], "cup_n1.obj", "cup_n2.ply", "my_plate_n1.obj")
    touch(tmp_path / folders[1], "cup.obj", "my_plate.stl")
    pairs = find_pairs(*(tmp_path / folder for folder in folders), PATTERN)
    assert names(pairs) == [("cup_n1.obj", "cup.obj"), ("cup_n2.ply", "cup.obj"), ("my_plate_n1.obj", "my_plate.stl")]


def test_lists_all_meshes_without_partner(tmp_path):
    touch(tmp_path / "noisy", "cup_n1.obj", "bowl_n1.obj", "lonely.obj")
    touch(tmp_path / "clean", "cup.obj", "spoon.obj")
    with pytest.raises(DataError, match=r"none for .*spoon\.obj, .*bowl_n1\.obj, .*lonely\.obj\). Rename or move"):
        find_pairs(tmp_path / "noisy", tmp_path / "clean", PATTERN)
    with pytest.raises(DataError, match="which does not exist"):
        find_pairs(tmp_path / "none", tmp_path / "clean", PATTERN)


def test_noisy_meshes_belong_to_the_longest_clean_name(tmp_path):
    touch(tmp_path / "original", "bunny.obj", "bunny_hi.ply", "notes.txt")
    touch(tmp_path / "noisy", "bunny_n1.obj", "bunny_hi_n1.obj", "bunny_hi_noisy.stl", "cat_n1.obj", "bunny_n1.txt")
    assert names(pair_meshes(tmp_path)) == [
        ("bunny_hi_n1.obj", "bunny_hi.ply"),
        ("bunny_hi_noisy.stl", "bunny_hi.ply"),
        ("bunny_n1.obj", "bunny.obj"),
    ]


def test_no_pair(tmp_path):
    touch(tmp_path / "original", "cat.obj")
    touch(tmp_path / "noisy", "dog_n1.obj")
    with pytest.raises(DataError, match="no such pair"):
        pair_meshes(tmp_path)


@pytest.mark.parametrize(
    ("subset", "count"), [("Synthetic", 4), ("Kinect_v1", 2), ("Kinect_v2", 2), ("Kinect_Fusion", 2)]
)
def test_pairs_of_the_published_layout(cnr_folder, subset, count):
    pairs = cnr_pairs(cnr_folder, subset, "train")
    assert len(pairs) == count
    assert all(noisy.stem.startswith(f"{clean.stem}_") for noisy, clean in pairs)


def test_list_files_decide(tmp_path):
    touch(tmp_path / "Kinect_v1" / "train" / "original", "ball.obj", "box.obj")
    touch(tmp_path / "Kinect_v1" / "train" / "noisy", "ball_noisy.obj", "box_noisy.obj")
    listing = tmp_path / "Kinect_v1" / "train_list.txt"
    listing.write_text("ball\n")
    assert names(cnr_pairs(tmp_path, "Kinect_v1", "train")) == [("ball_noisy.obj", "ball.obj")]
    listing.write_text("ball\nabsent\n")
    with pytest.raises(DataError, match=r"got none for \['absent'\]\). Add the meshes"):
        cnr_pairs(tmp_path, "Kinect_v1", "train")


@pytest.mark.parametrize("above", [0, 1, 2])
def test_folder_is_found_from_above(test_set, above):
    assert find_test_folder([test_set, *test_set.parents][above]) == test_set.resolve()


def test_several_test_folders_are_named(tmp_path):
    for subset in ("one", "two"):
        touch(tmp_path / subset / "test" / "original")
        touch(tmp_path / subset / "test" / "noisy")
    with pytest.raises(DataError, match=r"one/test, .*two/test"):
        find_test_folder(tmp_path)


@pytest.mark.parametrize(("val_share", "expected"), [(0.5, "bd"), (0.25, "c"), (0.01, "c"), (0.75, "acd")])
def test_meshes_held_back_with_all_their_noisy_versions(val_share, expected):
    pairs = [(Path(f"{name}_n{i}.obj"), Path(f"{name}.obj")) for name in "abcd" for i in (1, 2)]
    held_back, others = (split_pairs(pairs, split, val_share) for split in ("val", "train"))
    assert {clean.stem for _, clean in held_back} == set(expected)
    assert sorted(held_back + others) == pairs
    assert len(held_back) == 2 * len(expected)


def test_no_mesh_is_held_back_for_a_share_of_0():
    pairs = [(None, Path("a.obj")), (None, Path("b.obj"))]
    assert split_pairs(pairs, "train", 0) == pairs
    with pytest.raises(DataError, match=r"at least one mesh for 'val' \(got 2 files and 'val_share' 0\)"):
        split_pairs(pairs, "val", 0)
    with pytest.raises(DataError, match=r"'val_share' from 0 to below 1 \(got 1\)"):
        split_pairs(pairs, "train", 1)
    with pytest.raises(DataError, match=r"at least one mesh for 'train' \(got 1 files and 'val_share' 0.1\)"):
        split_pairs(pairs[:1], "train", 0.1)


def test_real_benchmark(cnr_root):
    pairs = pair_meshes(find_test_folder(cnr_root))
    assert len(pairs) == 36
    assert len({clean for _, clean in pairs}) == 12
    assert len(cnr_pairs(cnr_root, "Synthetic", "test")) == 36
    assert len(cnr_pairs(cnr_root, "Synthetic", "train")) == 3 * 41
