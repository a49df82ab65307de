import torch

from dnf_pyg.datamodules import CleanMeshesDataModule, GeneratedDataModule, LoaderOptions
from dnf_pyg.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.patches import PatchOptions

SMALL = {
    "patches": PatchOptions(num_patches=3, patch_size=40, k=8),
    "loader": LoaderOptions(batch_size=2, rotate=False, jitter=0.0),
}


def test_makes_the_meshes_once(tmp_path):
    data = GeneratedDataModule(str(tmp_path), kinds=["simple", "blob"], num_meshes=1, num_faces=600, **SMALL)
    data.prepare_data()
    files = sorted((tmp_path / "raw").iterdir())
    assert [path.name for path in files] == ["blob-0-600.ply", "simple-0-600.ply"]
    times = [path.stat().st_mtime_ns for path in files]
    data.prepare_data()
    assert [path.stat().st_mtime_ns for path in files] == times
    batch = next(iter(data.train_dataloader()))
    assert batch.x.shape == (80, 3)


def test_noise_is_new_in_training_and_fixed_in_validation(clean_folder, tmp_path):
    data = CleanMeshesDataModule(str(clean_folder), cache=str(tmp_path / "cache"), val_share=0.34, **SMALL)
    train, val = data.dataset("train"), data.dataset("val")
    assert isinstance(train, PatchDataset)
    assert not torch.equal(train[0].x, train[0].x)
    assert torch.equal(train[0].y, train[0].y)
    assert torch.equal(val[0].x, val[0].x)
    assert not torch.equal(val[0].x, val[0].y)


def test_fresh_patches_differ_from_epoch_to_epoch_in_training_only(clean_folder, tmp_path):
    data = CleanMeshesDataModule(str(clean_folder), cache=str(tmp_path / "cache"), val_share=0.34, fresh=True, **SMALL)
    train, val = data.dataset("train"), data.dataset("val")
    assert isinstance(train, FreshPatchDataset)
    assert len({tuple(train[0].face_id.tolist()) for _ in range(4)}) > 1
    assert torch.equal(val[0].face_id, val[0].face_id)
    assert torch.equal(val[0].x, val[0].x)
