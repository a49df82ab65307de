"""The command ``dnf-pyg fit``: its data modules, where a run writes, and how it goes on after it was stopped."""

import csv
import shutil

import pytest
import torch
import trimesh
import yaml

from dnf_pyg.cli import main

LOGGERS = ("TensorBoardLogger", "CSVLogger")
CAMERA = {"class_path": "dnf_pyg.synthetic.depth_camera.KinectV2", "init_args": {"distance": 1.5}}
DATA = {
    "CNRDataModule": {"root": "cnr"},
    "CleanMeshesDataModule": {"root": "clean"},
    "DepthCameraDataModule": {"root": "clean", "cache": "cache", "num_views": 1, "camera": CAMERA},
    "GeneratedDataModule": {"root": "generated", "kinds": ["blob"], "num_meshes": 2, "num_faces": 500},
    "PairsDataModule": {"noisy": "noisy", "clean": "clean", "pattern": "(.+)_noisy"},
}


@pytest.fixture
def config(tmp_path, monkeypatch):
    """A small run of three epochs of four steps, which keeps its last step and has no folder of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clean").mkdir()
    for number in range(3):
        box = trimesh.creation.box(extents=(1, 2, 1 + number)).subdivide().subdivide()
        box.export(tmp_path / "clean" / f"box{number}.ply")
    last = {"monitor": "val/theta", "filename": "best", "save_last": True}
    often = {"every_n_train_steps": 1, "save_top_k": 0, "save_last": True}
    content = {
        "seed_everything": 0,
        "trainer": {
            "max_epochs": 3,
            "accelerator": "cpu",
            "log_every_n_steps": 1,
            "enable_progress_bar": False,
            "enable_model_summary": False,
            "logger": [
                {"class_path": f"lightning.pytorch.loggers.{name}", "init_args": {"save_dir": "runs", "name": "small"}}
                for name in LOGGERS
            ],
            "callbacks": [
                {"class_path": "lightning.pytorch.callbacks.ModelCheckpoint", "init_args": options}
                for options in (last, often)
            ],
        },
        "model": {
            "net": {
                "class_path": "dnf_pyg.nn.DNFNet",
                "init_args": {"k": [3, 5, 8], "channels": [8, 8, 8], "embedding_channels": 8, "residual_k": 4},
            }
        },
        "data": {
            "class_path": "dnf_pyg.datamodules.CleanMeshesDataModule",
            "init_args": {
                "root": "clean",
                "patches": {"num_patches": 4, "patch_size": 40, "k": 8},
                "loader": {"batch_size": 2, "jitter": 0.0},
            },
        },
    }
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(content))
    return tmp_path


def fit(*words, command="fit"):
    assert main([command, "-c", "small.yaml", *words]) == 0


def with_data(config, name, **options):
    """The config with another data module."""
    content = yaml.safe_load((config / "small.yaml").read_text())
    content["data"] = {"class_path": f"dnf_pyg.datamodules.{name}", "init_args": {**DATA[name], **options}}
    (config / "small.yaml").write_text(yaml.safe_dump(content))


def curve(*paths):
    """Loss of each step; steps done again overwrite."""
    rows = [row for path in paths for row in csv.DictReader(path.read_text().splitlines()) if row["train/loss"]]
    return {int(row["step"]): float(row["train/loss"]) for row in rows}


def test_stopped_run_goes_on_in_its_folder_with_the_same_curve(config):
    fit()
    (config / "runs").rename(config / "whole")
    fit("--trainer.max_steps=6")  # in the middle of the second epoch
    best = config / "runs" / "small" / "version_0" / "checkpoints" / "best.ckpt"
    before = best.stat().st_mtime_ns
    fit("--ckpt_path=last")
    folder = config / "runs" / "small" / "version_0"
    assert [path.name for path in folder.parent.iterdir()] == ["version_0"]
    first, second = folder / "metrics-1.csv", folder / "metrics.csv"
    whole = curve(config / "whole" / "small" / "version_0" / "metrics.csv")
    assert sorted(whole) == list(range(12))
    assert sorted(curve(first)) == list(range(6))
    assert sorted(curve(second)) == list(range(6, 12))
    assert curve(first, second) == pytest.approx(whole, abs=1e-6)
    assert len(list(folder.glob("events.out.tfevents*"))) == 2
    assert sorted(path.name for path in best.parent.glob("best*")) == ["best.ckpt"]
    assert best.stat().st_mtime_ns > before
    assert torch.load(best, weights_only=True)["network"]["arguments"]["k"] == [3, 5, 8]


def test_launched_again_begins_the_next_folder_with_all_of_its_own(config):
    for number in range(2):
        fit("--trainer.max_epochs=1")
        folder = config / "runs" / "small" / f"version_{number}"
        names = {path.name.partition(".")[0] for path in folder.iterdir()}
        assert names == {"checkpoints", "config", "events", "hparams", "metrics"}
    kept = yaml.safe_load((folder / "config.yaml").read_text())
    assert [logger["init_args"]["version"] for logger in kept["trainer"]["logger"]] == [None, None]
    (folder / "config.yaml").rename(config / "small.yaml")  # what is kept can be launched
    fit("--trainer.max_epochs=1")
    assert (config / "runs" / "small" / "version_2" / "metrics.csv").is_file()


def test_newest_last_checkpoint_is_tested_in_a_folder_of_its_own(config):
    fit("--trainer.max_epochs=1")
    curves = (config / "runs" / "small" / "version_0" / "metrics.csv").read_bytes()
    fit("--ckpt_path=last", command="test")
    assert (config / "runs" / "small" / "version_0" / "metrics.csv").read_bytes() == curves
    tested = (config / "runs" / "small" / "version_1" / "metrics.csv").read_text()
    fit("--ckpt_path=runs/small/version_0/checkpoints/last.ckpt", command="test")
    assert (config / "runs" / "small" / "version_2" / "metrics.csv").read_text() == tested


def test_first_launch_may_ask_for_the_last_checkpoint(config):
    fit("--ckpt_path=last", "--trainer.max_epochs=1")
    assert sorted(curve(config / "runs" / "small" / "version_0" / "metrics.csv")) == list(range(4))


def test_folder_that_is_named_is_used_again_and_earlier_curves_stay(config):
    content = yaml.safe_load((config / "small.yaml").read_text())
    for logger in content["trainer"]["logger"]:
        logger["init_args"]["version"] = ""
    (config / "small.yaml").write_text(yaml.safe_dump(content))
    fit("--trainer.max_epochs=1")
    fit("--trainer.max_epochs=2", "--ckpt_path=last")
    fit("--trainer.max_epochs=1")
    folder = config / "runs" / "small"
    assert not list(folder.glob("version_*"))
    steps = [sorted(curve(folder / name)) for name in ("metrics-1.csv", "metrics-2.csv", "metrics.csv")]
    assert steps == [list(range(4)), list(range(4, 8)), list(range(4))]


@pytest.mark.parametrize("name", DATA)
def test_data_module_by_its_class_path(config, cnr_folder, name):
    shutil.copytree(cnr_folder, config / "cnr")
    shutil.copytree(config / "clean", config / "noisy")
    for path in (config / "noisy").iterdir():
        path.rename(path.with_stem(f"{path.stem}_noisy"))
    with_data(config, name, patches={"num_patches": 2, "patch_size": 30, "k": 8}, loader={"batch_size": 2})
    fit("--trainer.fast_dev_run=true")


@pytest.mark.parametrize("name", DATA)
def test_misspelt_key_of_a_data_module_is_refused(config, capsys, name):
    for wrong in ({"valshare": 0}, {"patches": {"patchsize": 30}}, {"loader": {"rotated": False}}):
        with_data(config, name, **wrong)
        assert main(["fit", "-c", "small.yaml"]) == 2
        told = capsys.readouterr().err
        assert next(key for key in ("valshare", "patchsize", "rotated") if key in str(wrong)) in told
        assert told.count("\n") == 1
    with_data(config, name, patches={"patch_size": "many"})
    assert main(["fit", "-c", "small.yaml"]) == 2
    assert "many" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["fit", "validate", "test"])
def test_nothing_in_a_checkpoint_is_instantiated(config, capsys, command):
    ran = config / "ran"
    optimizer = {"class_path": "os.system", "init_args": {"command": f"touch {ran}"}}
    content = {"state_dict": {}, "pytorch-lightning_version": "2.6.0", "hyper_parameters": {"optimizer": optimizer}}
    torch.save(content, config / "evil.ckpt")
    assert main([command, "-c", "small.yaml", "--ckpt_path=evil.ckpt"]) == 2
    assert "Expected a description of a network (got None" in capsys.readouterr().err
    assert not ran.exists()


@pytest.mark.parametrize("allowed", [False, True])
def test_class_of_another_module_has_to_be_allowed(config, capsys, monkeypatch, allowed):
    module = f"stranger_{allowed}"
    (config / f"{module}.py").write_text(
        "open('imported', 'w').close()\nfrom lightning.pytorch import Callback\nclass Mine(Callback): pass\n"
    )
    monkeypatch.syspath_prepend(config)
    content = yaml.safe_load((config / "small.yaml").read_text())
    content["trainer"]["callbacks"].append({"class_path": f"{module}.Mine"})
    (config / "small.yaml").write_text(yaml.safe_dump(content))
    words = ["--allow_class", module] if allowed else []
    assert main(["fit", "-c", "small.yaml", "--trainer.fast_dev_run=true", *words]) == (0 if allowed else 2)
    assert (config / "imported").exists() == allowed
    assert (f"(got '{module}.Mine')" in capsys.readouterr().err) != allowed
