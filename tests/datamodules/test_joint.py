import pytest
import torch
import trimesh
from lightning.pytorch import Callback, Trainer, seed_everything
from lightning.pytorch.callbacks import EMAWeightAveraging, ModelCheckpoint
from lightning.pytorch.loggers import CSVLogger

from dnf_pyg.cli import main
from dnf_pyg.datamodules import CleanMeshesDataModule, JointDataModule, LoaderOptions, PairsDataModule
from dnf_pyg.errors import DataError, WeightsError
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.settings import PartSettings
from dnf_pyg.weights.load import load_network

PARTS = {"clean": PartSettings([3, 4, 6], 0.5)}


class Curve(Callback):
    def __init__(self):
        self.values = []

    def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
        self.values.append(float(outputs["loss"]))


def joint(clean_folder, pair_folders, num_patches=3):
    one = CleanMeshesDataModule(str(clean_folder), patches=PatchOptions(5, 40, k=6), loader=LoaderOptions(batch_size=2))
    two = PairsDataModule(
        str(pair_folders[1]),
        str(clean_folder),
        patches=PatchOptions(num_patches, 50, k=12),
        loader=LoaderOptions(batch_size=3),
    )
    return JointDataModule({"clean": one, "pairs": two})


def fit(data, folder, **options):
    seed_everything(0)
    net = DNFNet(k=(4, 8, 12), channels=(8, 8, 8), embedding_channels=8, residual_k=4)
    module = NormalFilteringModule(net, **{"parts": PARTS, **options})
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


def test_weights_tell_the_noise_levels_of_their_data(clean_folder, pair_folders, tmp_path):
    def noise_range(levels, data_set=None):
        parts = joint(clean_folder, pair_folders).parts
        for name, level in levels.items():
            parts[name].hparams["noise_level"] = level
        split = ["clean", "pairs"] if data_set else None
        _, trainer = fit(JointDataModule(parts), tmp_path, separate_statistics=split)
        trainer.save_checkpoint(tmp_path / "last.ckpt")
        return load_network(tmp_path / "last.ckpt", data_set).noise_range

    assert noise_range({"clean": [0.1, 0.3], "pairs": [0.2, 0.5]}) == (0.1, 0.5)
    assert noise_range({"clean": [0.1, 0.3]}) is None  # the pairs bring their own noise
    assert noise_range({"clean": [0.1, 0.3]}, "clean") == (0.1, 0.3)
    assert noise_range({"clean": [0.1, 0.3]}, "pairs") is None


def test_leaves_out_data_sets_that_have_ended(clean_folder, pair_folders):
    data = joint(clean_folder, pair_folders)
    batch, _, _ = next(iter(data.train_dataloader()))
    assert data.on_after_batch_transfer({**batch, "ended": None}, 0).keys() == {"clean", "pairs"}


def test_predicts_every_test_patch_of_each_data_set(clean_folder, pair_folders, tmp_path):
    data = joint(clean_folder, pair_folders)
    module, trainer = fit(data, tmp_path, separate_statistics=["clean", "pairs"])
    filtered = trainer.predict(module, data)
    for (name, part), found in zip(data.parts.items(), filtered, strict=True):
        net = module.network_for(name)
        for batch, normal in zip(part.test_dataloader(), found, strict=True):
            with torch.no_grad():
                torch.testing.assert_close(normal, {name: net(**net.gather(batch))})


def test_a_checkpoint_of_several_statistics_asks_for_the_data_set(clean_folder, pair_folders, tmp_path, capsys):
    module, trainer = fit(joint(clean_folder, pair_folders), tmp_path, separate_statistics=["clean", "pairs"])
    path = tmp_path / "joint.ckpt"
    trainer.save_checkpoint(path)
    for wrong in (None, "kinect"):
        with pytest.raises(WeightsError, match=rf"Expected 'data_set' to be one of clean, pairs \(got {wrong!r}"):
            load_network(path, data_set=wrong)
    states = {name: load_network(path, data_set=name).state_dict() for name in ("clean", "pairs")}
    for name, state in states.items():
        torch.testing.assert_close(state, module.network_for(name).state_dict(), rtol=0, atol=0)
    trimesh.creation.icosphere(subdivisions=2).export(tmp_path / "ball.ply")
    words = ["denoise", str(tmp_path / "ball.ply"), "-o", str(tmp_path / "out.ply"), "--weights", str(path)]
    assert main(words) == 2
    assert "'data_set' to be one of clean, pairs (got None" in capsys.readouterr().err
    assert main([*words, "--data_set", "pairs"]) == 0
    key = "embedding.fuse.norms.0.module.running_mean"
    assert not torch.allclose(states["clean"][key], states["pairs"][key])
    content = torch.load(path, weights_only=True)
    again = NormalFilteringModule.load_from_checkpoint(path)
    torch.testing.assert_close(dict(again.state_dict()), dict(content["state_dict"]), rtol=0, atol=0)
    del content["statistics"]  # as before the names were kept
    torch.save(content, path)
    with pytest.raises(WeightsError, match="no statistics are kept by name"):
        load_network(path)


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
    module, curve = NormalFilteringModule(net, parts=PARTS, separate_statistics=["clean", "pairs"]), Curve()
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


def test_rejects_parts_that_do_not_fit(clean_folder, pair_folders, tmp_path):
    with pytest.raises(DataError, match=r"'patches.k' of at least 7, .* \(got 6\)"):
        fit(joint(clean_folder, pair_folders), tmp_path, parts={"clean": PartSettings([3, 4, 7])})
    with pytest.raises(DataError, match=r"data sets \['clean', 'pairs'\] \(got \['cleen'\]\)\. Use the names"):
        fit(joint(clean_folder, pair_folders), tmp_path, parts={**PARTS, "cleen": PartSettings()})
    with pytest.raises(ValueError, match="at least one data set"):
        JointDataModule({})
