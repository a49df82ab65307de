import torch

from dnf_pyg.datamodules import CNRDataModule, LoaderOptions
from dnf_pyg.datasets import CNR
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import HeatGrowth
from dnf_pyg.patches import PatchExtractor, PatchOptions


def module(root, cache, growth=None, **options):
    patches = PatchOptions(num_patches=3, patch_size=40, k=8, growth=growth)
    return CNRDataModule(str(root), patches=patches, loader=LoaderOptions(batch_size=2), cache=str(cache), **options)


def test_serves_every_split(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path, val_share=0.5)
    for loader in (data.train_dataloader(), data.val_dataloader(), data.test_dataloader(), data.predict_dataloader()):
        batch = next(iter(loader))
        assert batch.x.shape == batch.y.shape == (80, 3)
        assert batch.seed_index.tolist() == [0, 40]
    names = [{clean.stem for _, clean in data.dataset(split).pairs} for split in ("train", "val")]
    assert not names[0] & names[1]


def test_all_meshes_are_trained_on_where_none_is_held_back(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path, val_share=0)
    assert {clean.stem for _, clean in data.dataset("train").pairs} == {"ball", "box"}
    assert data.val_dataloader() == []


def test_numbers_are_those_of_the_paper_unless_given():
    assert CNRDataModule("absent").patches == PatchOptions(100, 800, 50)
    assert CNRDataModule("absent", "Kinect_Fusion").patches == PatchOptions(200, 800, 150)
    assert CNRDataModule("absent", "Kinect_v1", PatchOptions(3, k=8)).patches == PatchOptions(3, 800, 8)


def test_test_patches_are_those_of_the_data_set(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path)
    expected = CNR(cnr_folder, "Synthetic", "test", patches=data.patches, cache=tmp_path)
    assert len(expected) == len(data.dataset("test")) == 6
    for one, other in zip(data.dataset("test"), expected, strict=True):
        assert torch.equal(one.face_id, other.face_id)
        assert torch.equal(one.x, other.x)


def test_patches_grow_as_configured(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path, HeatGrowth()).dataset("test")
    mesh = read_mesh(data.pairs[0][0])
    extractor = PatchExtractor(mesh.pos, mesh.face, HeatGrowth(), patch_size=40, k=8)
    for patch in (data[0], data[1]):
        torch.testing.assert_close(patch.face_id, extractor.extract(int(patch.face_id[0])).face_id)
    assert data.processed_file_names != module(cnr_folder, tmp_path).dataset("test").processed_file_names
