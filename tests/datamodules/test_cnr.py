import pytest
import torch

from dnf_pyg.datamodules.cnr import CNRDataModule, cnr_pairs
from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import HeatGrowth
from dnf_pyg.patches import PatchExtractor


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


def test_missing_folder_names_the_source_and_the_layout(tmp_path):
    text = r"Synthetic.train.original\).*Cascaded Normal Regression.*project page.*ROOT/SUBSET/\{train,test\}/"
    with pytest.raises(DataError, match=text):
        cnr_pairs(tmp_path, "Synthetic", "train")


@pytest.mark.parametrize(
    ("subset", "numbers"),
    [("Synthetic", (100, 800, 50)), *((f"Kinect_{kind}", (200, 800, 150)) for kind in ("v1", "v2", "Fusion"))],
)
def test_numbers_are_those_of_the_paper_unless_given(subset, numbers):
    names = ("num_patches", "patch_size", "k")
    options = CNRDataModule("absent", subset).options
    assert tuple(options[name] for name in names) == numbers
    given = CNRDataModule("absent", subset, num_patches=3, k=8).options
    assert (given.num_patches, given.k) == (3, 8)
    assert "synthetic" not in options


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
