import pytest
import torch

from datamodules.cnr import CNRDataModule, cnr_pairs
from dnf_pyg.data import PatchExtractor
from dnf_pyg.errors import DataError
from dnf_pyg.mesh import HeatGrowth
from dnf_pyg.mesh.io import read_mesh


def module(root, cache, **options):
    return CNRDataModule(str(root), cache=str(cache), num_patches=3, patch_size=40, k=8, batch_size=2, **options)


@pytest.mark.parametrize(
    ("subset", "count"), [("Synthetic", 4), ("Kinect_v1", 2), ("Kinect_v2", 2), ("Kinect_Fusion", 2)]
)
def test_pairs_of_the_published_layout(cnr_folder, subset, count):
    pairs = cnr_pairs(cnr_folder, subset, "train")
    assert len(pairs) == count
    assert all(noisy.stem.startswith(f"{clean.stem}_") for noisy, clean in pairs)


def test_serves_every_split(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path, val_share=0.5)
    for loader in (data.train_dataloader(), data.val_dataloader(), data.test_dataloader(), data.predict_dataloader()):
        batch = next(iter(loader))
        assert batch.normal.shape == batch.clean_normal.shape == (80, 3)
        assert batch.seed_index.tolist() == [0, 40]
    names = [{clean.stem for _, clean in data.dataset(split).pairs} for split in ("train", "val")]
    assert not names[0] & names[1]


def test_list_files_decide(cnr_folder):
    listing = cnr_folder / "Kinect_v1" / "train_list.txt"
    try:
        listing.write_text("ball\n")
        assert [clean.stem for _, clean in cnr_pairs(cnr_folder, "Kinect_v1", "train")] == ["ball"]
        listing.write_text("ball\nabsent\n")
        with pytest.raises(DataError, match=r"got none for \['absent'\]"):
            cnr_pairs(cnr_folder, "Kinect_v1", "train")
    finally:
        listing.unlink()


def test_missing_folder_names_the_source(tmp_path):
    with pytest.raises(DataError, match="Cascaded Normal Regression"):
        cnr_pairs(tmp_path, "Synthetic", "train")


def test_the_benchmark_itself(cnr_root):
    assert len(cnr_pairs(cnr_root, "Synthetic", "test")) == 36
    assert len(cnr_pairs(cnr_root, "Synthetic", "train")) == 3 * 41


def test_patches_grow_as_configured(cnr_folder, tmp_path):
    data = module(cnr_folder, tmp_path, growth=HeatGrowth()).dataset("test")
    mesh = read_mesh(data.pairs[0][0])
    extractor = PatchExtractor(mesh.pos, mesh.face, HeatGrowth(), patch_size=40, k=8)
    for patch in (data[0], data[1]):
        torch.testing.assert_close(patch.face_id, extractor.extract(int(patch.face_id[0])).face_id)
    assert data.processed_file_names != module(cnr_folder, tmp_path).dataset("test").processed_file_names
