from dnf_pyg.datamodules import LoaderOptions, PairsDataModule
from dnf_pyg.patches import PatchOptions


def module(pair_folders, **options):
    clean, noisy = pair_folders
    return PairsDataModule(
        str(noisy), str(clean), patches=PatchOptions(4, 40, k=8), loader=LoaderOptions(batch_size=2), **options
    )


def test_serves_pairs_and_holds_meshes_back(pair_folders):
    data = module(pair_folders, val_share=0.34)
    train, val = next(iter(data.train_dataloader())), next(iter(data.val_dataloader()))
    for batch in (train, val):
        assert batch.x.shape == batch.y.shape == (80, 3)
        assert batch.edge_index.shape == (2, 80 * 8)
        assert batch.batch.tolist() == [0] * 40 + [1] * 40
    names = [{path.stem for _, path in data.dataset(split).pairs} for split in ("train", "val")]
    assert len(names[0]) == 2
    assert len(names[1]) == 1
    assert not names[0] & names[1]
