"""Every config fits on tiny data: all of its classes, names and values are right."""

from pathlib import Path

import pytest
import yaml

from dnf_pyg.cli import main

CONFIGS = sorted((Path(__file__).resolve().parents[1] / "configs").glob("*.yaml"))
SMALL_NET = ["--model.net.channels=[4,4,4]", "--model.net.embedding_channels=4", "--model.net.residual_k=4"]


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_config_fits(path, cnr_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    config = yaml.safe_load(path.read_text())["data"]
    small, cache = {"patch_size": 60, "num_patches": 2, "batch_size": 2}, tmp_path / "cache"
    if config["class_path"].endswith("JointDataModule"):
        options = {
            f"parts.{name}.data.init_args.{key}": value
            for name in config["init_args"]["parts"]
            for key, value in {**small, "root": cnr_folder, "cache": cache}.items()
        }
    elif config["class_path"].endswith("CNRDataModule"):
        options = {**small, "root": cnr_folder, "cache": cache}
    elif config["class_path"].endswith("CleanMeshesDataModule"):
        options = {**small, "root": cnr_folder / "Synthetic/train/original", "names": "null", "cache": cache}
    else:
        options = {**small, "root": tmp_path / "data", "num_faces": 500, "num_meshes": 2}
    words = [f"--data.{key}={value}" for key, value in options.items()]
    words += ["--trainer.fast_dev_run=true", "--trainer.accelerator=cpu"]
    assert main(["fit", "-c", str(path), *SMALL_NET, *words]) == 0


def test_paper_settings_are_complete():
    for name, subset, k, num_patches in (("synthetic", "Synthetic", 50, 100), ("kinect", "Kinect_v1", 150, 200)):
        config = yaml.safe_load((CONFIGS[0].parent / f"{name}.yaml").read_text())
        data = config["data"]["init_args"]
        assert (data["subset"], data["k"], data["num_patches"]) == (subset, k, num_patches)
        assert (data["patch_size"], data["batch_size"]) == (800, 10)
        assert max(config["model"]["net"]["init_args"]["k"]) == k
        assert config["trainer"]["max_epochs"] == 400
        assert config["model"]["loss"]["init_args"]["alpha"] == 0.5
        assert config["model"]["optimizer"] == {"class_path": "torch.optim.Adam", "init_args": {"lr": 1e-3}}
