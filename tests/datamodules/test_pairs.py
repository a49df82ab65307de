import pytest

from dnf_pyg.datamodules.pairs import PairsDataModule, find_pairs
from dnf_pyg.errors import DataError

PATTERN = r"(.+)_n\d+"


def module(pair_folders, **options):
    clean, noisy = pair_folders
    return PairsDataModule(str(noisy), str(clean), num_patches=4, patch_size=40, k=8, batch_size=2, **options)


def test_serves_pairs_and_holds_meshes_back(pair_folders):
    data = module(pair_folders, val_share=0.34)
    train, val = next(iter(data.train_dataloader())), next(iter(data.val_dataloader()))
    for batch in (train, val):
        assert batch.normal.shape == batch.clean_normal.shape == (80, 3)
        assert batch.edge_index.shape == (2, 80 * 8)
        assert batch.batch.tolist() == [0] * 40 + [1] * 40
    names = [{path.stem for _, path in data.dataset(split).pairs} for split in ("train", "val")]
    assert len(names[0]) == 2
    assert len(names[1]) == 1
    assert not names[0] & names[1]


def test_finds_pairs_in_one_folder(pair_folders):
    clean, noisy = pair_folders
    for path in clean.iterdir():
        path.rename(noisy / path.name)
    assert len(find_pairs(noisy, noisy, PATTERN)) == 6


def test_lists_all_files_without_partner(pair_folders):
    clean, noisy = pair_folders
    (noisy / "box0_n1.obj").rename(noisy / "lonely.obj")
    (clean / "box2.obj").unlink()
    with pytest.raises(DataError, match=r"box2_n1\.obj.*box2_n2\.obj.*lonely\.obj"):
        find_pairs(noisy, clean, PATTERN)


def test_names_a_missing_folder(tmp_path):
    with pytest.raises(DataError, match="which does not exist"):
        find_pairs(tmp_path / "none", tmp_path, PATTERN)
