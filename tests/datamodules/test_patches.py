import pytest
import torch
from lightning.pytorch import LightningModule, Trainer

from dnf_pyg.datamodules import (
    CleanMeshesDataModule,
    CNRDataModule,
    DepthCameraDataModule,
    GeneratedDataModule,
    LoaderOptions,
    PairsDataModule,
    sampling,
)
from dnf_pyg.errors import DataError
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.weights.load import load_network

SMALL = {"patches": PatchOptions(num_patches=3, patch_size=30, k=8), "loader": LoaderOptions(batch_size=2)}


@pytest.fixture
def make(pair_folders, cnr_folder, tmp_path):
    """Makes each of the data modules over small meshes."""
    clean, noisy = map(str, pair_folders)
    kinds = {
        "cnr": lambda **options: CNRDataModule(str(cnr_folder), **options),
        "pairs": lambda **options: PairsDataModule(noisy, clean, **options),
        "clean": lambda **options: CleanMeshesDataModule(clean, **options),
        "camera": lambda **options: DepthCameraDataModule(clean, num_views=1, **options),
    }

    def build(kind, **options):
        options = {**SMALL, "cache": str(tmp_path / "cache"), **options}
        if kind == "generated":
            del options["cache"]
            return GeneratedDataModule(str(tmp_path), ["blob"], num_meshes=2, num_faces=400, **options)
        return kinds[kind](**options)

    return build


@pytest.fixture
def trainer(tmp_path):
    return Trainer(
        accelerator="cpu", max_epochs=1, logger=False, enable_progress_bar=False, enable_model_summary=False,
        enable_checkpointing=False, default_root_dir=tmp_path,
    )  # fmt: skip


def network(k=(3, 5, 8)):
    torch.manual_seed(0)
    return NormalFilteringModule(DNFNet(k=k, channels=(8, 8, 8), embedding_channels=8, residual_k=4))


@pytest.mark.parametrize("kind", ["cnr", "pairs", "clean", "camera", "generated"])
def test_predicts_every_test_patch_in_order(make, trainer, kind):
    data, module = make(kind), network()
    filtered = trainer.predict(module, data)
    patches = data.dataset("test")
    assert sum(len(normal) for normal in filtered) == sum(patch.num_nodes for patch in patches)
    module.eval()
    for batch, normal in zip(data.test_dataloader(), filtered, strict=True):
        torch.testing.assert_close(normal, module(batch))


@pytest.mark.parametrize("kind", ["cnr", "clean"])
def test_trains_on_all_meshes_where_none_is_held_back(make, trainer, kind):
    data, module = make(kind, val_share=0), network()
    trainer.fit(module, data)
    assert trainer.num_training_batches == -(-len(data.dataset("train")) // 2)
    assert len(data.dataset("train").pairs) == {"cnr": 4, "clean": 3}[kind]
    assert sum(trainer.num_val_batches) == 0
    assert not any(name.startswith("val/") for name in trainer.callback_metrics)
    with pytest.raises(DataError, match=r"for 'val' \(got \d files and 'val_share' 0\). Add meshes, or change"):
        trainer.validate(module, data)


def test_fewer_neighbors_than_the_network_uses_are_refused_before_anything_is_prepared(make, trainer, tmp_path):
    data = make("clean")
    for run in (trainer.fit, trainer.test, trainer.predict):
        with pytest.raises(DataError, match=r"'patches.k' of at least 9, .* \(got 8\). Raise `data.patches.k`, or"):
            run(network(k=(3, 5, 9)), data)
    assert not (tmp_path / "cache").exists()


def test_serves_modules_without_such_a_network(make, trainer):
    class Mean(LightningModule):
        def predict_step(self, batch, batch_idx):
            return batch.x.mean(dim=0)

    assert len(trainer.predict(Mean(), make("pairs"))) == 3


def test_fewer_held_back_patches_than_processes_would_leave_one_waiting(make, monkeypatch):
    data = make("clean")
    assert len(list(data.val_dataloader())) == 2
    monkeypatch.setattr(sampling, "_processes", lambda: (4, 3))
    with pytest.raises(DataError, match="got 3 patches for 4 processes"):
        data.val_dataloader()


def test_shares_of_all_processes_are_every_patch_once(monkeypatch):
    shares = []
    for rank in range(3):
        monkeypatch.setattr(sampling, "_processes", lambda rank=rank: (3, rank))
        shares += list(sampling.ShareSampler(range(8)))
    assert sorted(shares) == list(range(8))


@pytest.mark.parametrize("kind", ["clean", "generated"])
def test_weights_tell_the_noise_levels_of_their_training(kind, make, trainer, tmp_path):
    trainer.fit(network(), make(kind, noise_level=(0.1, 0.4), val_share=0))
    trainer.save_checkpoint(tmp_path / "last.ckpt")
    assert load_network(tmp_path / "last.ckpt").noise_range == (0.1, 0.4)


@pytest.mark.parametrize("rotate", [True, False])
def test_weights_tell_whether_patches_were_rotated(rotate, make, trainer, tmp_path):
    trainer.fit(network(), make("clean", loader=LoaderOptions(rotate=rotate), val_share=0))
    trainer.save_checkpoint(tmp_path / "last.ckpt")
    assert load_network(tmp_path / "last.ckpt").random_rotation == rotate
