import torch
import trimesh

from dnf_pyg.datamodules import DepthCameraDataModule, LoaderOptions
from dnf_pyg.io import read_mesh
from dnf_pyg.patches import PatchOptions
from dnf_pyg.synthetic.depth_camera import KinectV1, KinectV2


def test_views_are_pairs_with_noise_and_a_boundary(clean_folder, tmp_path):
    patches = PatchOptions(num_patches=3, patch_size=30, k=8)
    options = {"num_views": 2, "patches": patches, "loader": LoaderOptions(batch_size=2), "val_share": 0.34}
    data = DepthCameraDataModule(str(clean_folder), str(tmp_path / "cache"), **options)
    data.prepare_data()
    noisy, clean = data.views(clean_folder / "box0.obj")[0]
    one, two = read_mesh(noisy), read_mesh(clean)
    assert torch.equal(one.face, two.face)
    assert one.face.size(1) < read_mesh(clean_folder / "box0.obj").face.size(1)
    assert not torch.equal(one.pos, two.pos)
    batch = next(iter(data.train_dataloader()))
    assert batch.x.shape == batch.y.shape
    assert 30 < batch.x.size(0) <= 60
    assert (len(data.dataset("train")), len(data.dataset("val"))) == (12, 6)
    before = noisy.stat().st_mtime_ns
    data.prepare_data()
    assert noisy.stat().st_mtime_ns == before


def test_views_are_made_again_for_another_camera_or_mesh(clean_folder, tmp_path):
    options = {"num_views": 1, "patches": PatchOptions(num_patches=2, patch_size=30, k=8)}
    path, seen = clean_folder / "box0.obj", []
    for camera in (KinectV1(), KinectV1(distance=1.5), KinectV2(), KinectV1()):
        data = DepthCameraDataModule(str(clean_folder), str(tmp_path / "cache"), camera, **options)
        data.prepare_data()
        seen.append(read_mesh(data.views(path)[0][0]).pos)
    assert torch.equal(seen[0], seen[3])
    assert len({float(pos[:, 2].mean()) for pos in seen}) == 3
    trimesh.creation.icosphere(2).export(path)
    data.prepare_data()
    assert read_mesh(data.views(path)[0][1]).pos.shape != seen[0].shape
