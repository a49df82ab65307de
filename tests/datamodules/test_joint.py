import pytest
import torch
from lightning.pytorch import Callback, Trainer, seed_everything
from lightning.pytorch.callbacks import EMAWeightAveraging, ModelCheckpoint
from lightning.pytorch.loggers import CSVLogger

from dnf_pyg.datamodules import CleanMeshesDataModule, JointDataModule, LoaderOptions, PairsDataModule, Part
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.module import NormalFilteringModule


class Curve(Callback):
    def __init__(self):
        self.values = []

    def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
        self.values.append(float(outputs["loss"]))


def joint(clean_folder, pair_folders, levels=(3, 4, 6), num_patches=3):
    one = CleanMeshesDataModule(str(clean_folder), patches=PatchOptions(5, 40, k=6), loader=LoaderOptions(batch_size=2))
    two = PairsDataModule(
        str(pair_folders[1]),
        str(clean_folder),
        patches=PatchOptions(num_patches, 50, k=12),
        loader=LoaderOptions(batch_size=3),
    )
    return JointDataModule({"clean": Part(one, list(levels), 0.5), "pairs": Part(two)})


def fit(data, folder, **options):
    seed_everything(0)
    net = DNFNet(k=(4, 8, 12), channels=(8, 8, 8), embedding_channels=8, residual_k=4)
    module = NormalFilteringModule(net, **options)
    trainer = Trainer(
        accelerator="cpu", max_epochs=1, logger=CSVLogger(folder), log_every_n_steps=1, enable_progress_bar=False,
        enable_model_summary=False, default_root_dir=folder,
    )  # fmt: skip
    trainer.fit(module, data)
    return module, trainer


def test_logs_loss_and_theta_of_each_data_set(clean_folder, pair_folders, tmp_path):
    _, trainer = fit(joint(clean_folder, pair_folders), tmp_path)
    values = trainer.callback_metrics
    for stage in ("train", "val"):
        total = values[f"{stage}/loss"]
        assert {f"{stage}/{name}/theta" for name in ("clean", "pairs")} <= values.keys()
        if stage == "train":
            torch.testing.assert_close(total, 0.5 * values["train/clean/loss"] + values["train/pairs/loss"])
    assert values["val/theta"] > 0


def test_batches_carry_levels_and_weight(clean_folder, pair_folders):
    data = joint(clean_folder, pair_folders)
    batch, _, _ = next(iter(data.train_dataloader()))
    batch = data.on_after_batch_transfer({**batch, "ended": None}, 0)
    assert batch.keys() == {"clean", "pairs"}
    assert (batch["clean"].levels, batch["clean"].weight) == ([3, 4, 6], 0.5)
    module = NormalFilteringModule(DNFNet(k=(4, 8, 12), channels=(8, 8, 8), embedding_channels=8, residual_k=4))
    assert [edges.size(1) for edges in module._edges(batch["clean"])] == [80 * 3, 80 * 4, 80 * 6]
    assert module._edges(batch["pairs"]) is batch["pairs"].edge_index


def test_statistics_stay_apart(clean_folder, pair_folders, tmp_path):
    module, _ = fit(joint(clean_folder, pair_folders), tmp_path, separate_statistics=["clean", "pairs"])
    kept = module.statistics.values_0
    assert kept.size(0) == 2
    assert not torch.allclose(kept[0], kept[1])
    assert any(key.startswith("statistics.values_") for key in module.state_dict())


def resumable(clean_folder, pair_folders, folder, stop=None, ckpt_path=None):
    """Train three epochs, averaged weights and statistics apart; ``stop`` after so many steps, or go on from there."""
    seed_everything(0)
    net = DNFNet(k=(4, 8, 12), channels=(8, 8, 8), embedding_channels=8, residual_k=4)
    module, curve = NormalFilteringModule(net, separate_statistics=["clean", "pairs"]), Curve()
    saved = ModelCheckpoint(folder, filename="{step}", every_n_train_steps=stop or 100, save_top_k=-1)
    trainer = Trainer(
        accelerator="cpu", max_epochs=3, max_steps=stop or -1, logger=False, enable_progress_bar=False,
        enable_model_summary=False, callbacks=[curve, EMAWeightAveraging(decay=0.7), saved], default_root_dir=folder,
    )  # fmt: skip
    data = joint(clean_folder, pair_folders, num_patches=1)  # five batches of one, two of the other
    trainer.fit(module, data, ckpt_path=ckpt_path, weights_only=True)
    return curve.values, module


@pytest.mark.parametrize("stop", [3, 7])  # in the second pass over the shorter data set, in the second epoch
def test_resumes_with_statistics_and_averages_of_its_own(clean_folder, pair_folders, tmp_path, stop):
    whole, expected = resumable(clean_folder, pair_folders, tmp_path / "whole")
    first, _ = resumable(clean_folder, pair_folders, tmp_path / "part", stop)
    path = tmp_path / "part" / f"step={stop}.ckpt"
    second, module = resumable(clean_folder, pair_folders, tmp_path / "part", ckpt_path=path)
    assert len(whole) > stop + 5
    assert first + second == pytest.approx(whole, abs=1e-6)
    for key, value in expected.state_dict().items():
        torch.testing.assert_close(module.state_dict()[key], value, rtol=1e-5, atol=1e-6)


def test_rejects_bad_parts(clean_folder, pair_folders):
    with pytest.raises(ValueError, match=r"levels' of 'clean' up to its k = 6 \(got \[3, 4, 7\]\)"):
        joint(clean_folder, pair_folders, levels=(3, 4, 7))
    with pytest.raises(ValueError, match="at least one data set"):
        JointDataModule({})
