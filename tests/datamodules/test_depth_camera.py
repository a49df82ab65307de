import torch

from datamodules import DepthCameraDataModule
from dnf_pyg.mesh.io import read_mesh


def test_views_are_pairs_with_noise_and_a_boundary(clean_folder, tmp_path):
    options = {"num_views": 2, "num_patches": 3, "patch_size": 30, "k": 8, "batch_size": 2, "val_share": 0.34}
    data = DepthCameraDataModule(str(clean_folder), str(tmp_path / "cache"), **options)
    data.prepare_data()
    noisy, clean = data._views("box0")[0]
    one, two = read_mesh(noisy), read_mesh(clean)
    assert torch.equal(one.face, two.face)
    assert one.face.size(1) < read_mesh(clean_folder / "box0.obj").face.size(1)
    assert not torch.equal(one.pos, two.pos)
    batch = next(iter(data.train_dataloader()))
    assert batch.normal.shape == batch.clean_normal.shape
    assert 30 < batch.normal.size(0) <= 60
    assert (len(data.dataset("train")), len(data.dataset("val"))) == (12, 6)
    before = noisy.stat().st_mtime_ns
    data.prepare_data()
    assert noisy.stat().st_mtime_ns == before
