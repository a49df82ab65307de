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
    data = yaml.safe_load(path.read_text())["data"]["init_args"]
    words = ["--data.patch_size=60", "--data.num_patches=2", "--data.batch_size=2"]
    if "root" in data:
        words += [f"--data.root={cnr_folder}", f"--data.cache={tmp_path / 'cache'}"]
    else:
        words += ["--data.num_faces=500", "--data.num_meshes=2", f"--data.root={tmp_path / 'data'}"]
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
