import pytest

from dnf_pyg.datamodules import CleanMeshesDataModule, sampling
from dnf_pyg.errors import DataError


def test_fewer_held_back_patches_than_processes_would_leave_one_waiting(clean_folder, tmp_path, monkeypatch):
    data = CleanMeshesDataModule(str(clean_folder), cache=str(tmp_path), num_patches=3, patch_size=30, k=8)
    assert len(list(data.val_dataloader())) == 1
    monkeypatch.setattr(sampling, "_processes", lambda: (4, 3))
    with pytest.raises(DataError, match="got 3 patches for 4 processes"):
        data.val_dataloader()


def test_shares_of_all_processes_are_every_patch_once(monkeypatch):
    shares = []
    for rank in range(3):
        monkeypatch.setattr(sampling, "_processes", lambda rank=rank: (3, rank))
        shares += list(sampling.ShareSampler(range(8)))
    assert sorted(shares) == list(range(8))
