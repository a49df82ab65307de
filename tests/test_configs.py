"""Every config fits on tiny data: all of its classes, names and values are right."""

from pathlib import Path

import pytest
import trimesh
import yaml

import dnf_pyg.nn
from dnf_pyg.cli import main
from dnf_pyg.datamodules import GeneratedDataModule
from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datasets.pairing import split_pairs
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
from dnf_pyg.patches import PatchOptions

FOLDER = Path(__file__).resolve().parents[1] / "configs"
SCHEDULE = FOLDER / "short_schedule.yaml"  # goes on top of another config
CONFIGS = sorted(set(FOLDER.glob("*.yaml")) - {SCHEDULE})
TABLE_1 = ["synthetic", *(path.stem for path in CONFIGS if path.stem.startswith("ablation"))]
SMALL_NET = ["--model.net.channels=[4,4,4]", "--model.net.embedding_channels=4", "--model.net.residual_k=4"]


def small_inputs(path, tmp_path):
    """The config as it is, but with tiny meshes to denoise and tiny networks in place of what earlier steps make."""
    content = yaml.safe_load(path.read_text())
    for callback in content["trainer"]["callbacks"]:
        if "meshes" in callback["init_args"]:
            trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "ball.ply")
            callback["init_args"] |= {"meshes": ["ball.ply"], "every_n_epochs": 1}
    teachers = content["model"].get("distillation", {}).get("init_args", {}).get("teachers", {})
    for name in teachers:
        DNFNet(k=(3, 5, 8), channels=(4, 4, 4), embedding_channels=4, residual_k=4).save_pretrained(tmp_path / name)
        teachers[name] = name
    if "initial_weights" in content["model"]:
        words = (word.removeprefix("--model.net.").split("=") for word in SMALL_NET)
        small = {name: yaml.safe_load(value) for name, value in words}
        net = getattr(dnf_pyg.nn, content["model"]["net"]["class_path"].rsplit(".", 1)[1])
        net(**{**content["model"]["net"]["init_args"], **small}).save_pretrained(tmp_path / "initial")
        content["model"]["initial_weights"] = "initial"
    refinement = content["data"]["init_args"].get("refinement", {}).get("init_args", {})
    if refinement:
        SurfaceDNFNet(k=(3, 5), channels=(4, 4), embedding_channels=4, residual_k=4).save_pretrained(tmp_path / "first")
        refinement["weights"] = "first"
    target = tmp_path / path.name
    target.write_text(yaml.safe_dump(content))
    return target


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_config_fits(path, cnr_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    config = yaml.safe_load(path.read_text())["data"]
    path = small_inputs(path, tmp_path)
    small = {"patches.patch_size": 60, "patches.num_patches": 2, "loader.batch_size": 2}
    cache = tmp_path / "cache"
    if config["class_path"].endswith("JointDataModule"):
        clean = cnr_folder / "Synthetic/train/original"
        options = {
            f"parts.{name}.init_args.{key}": value
            for name, part in config["init_args"]["parts"].items()
            for key, value in {
                **small,
                "root": clean if "Clean" in part["class_path"] else cnr_folder,
                "cache": cache,
            }.items()
        }
    elif config["class_path"].endswith("CNRDataModule"):
        options = {**small, "root": cnr_folder, "cache": cache}
    elif config["class_path"].endswith("CleanMeshesDataModule"):
        options = {**small, "root": cnr_folder / "Synthetic/train/original", "names": "null", "cache": cache}
    elif config["class_path"].endswith("PairsDataModule"):
        folder = cnr_folder / "Synthetic/train"
        options = {**small, "noisy": folder / "noisy", "clean": folder / "original", "cache": cache}
    else:
        options = {**small, "root": tmp_path / "data", "num_faces": 500, "num_meshes": 2}
    words = [f"--data.{key}={value}" for key, value in options.items()]
    words += ["--trainer.fast_dev_run=true", "--trainer.accelerator=cpu"]
    assert main(["fit", "-c", str(path), *SMALL_NET, *words]) == 0


@pytest.mark.parametrize("row", TABLE_1)
def test_short_schedule_goes_on_top_of_each_row_of_table_1(row, cnr_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = {"root": cnr_folder, "cache": tmp_path / "cache", "patches.patch_size": 60, "patches.num_patches": 2}
    words = [f"--data.{key}={value}" for key, value in small.items()] + SMALL_NET
    words += ["--trainer.max_steps=2", "--trainer.accelerator=cpu"]
    assert main(["fit", "-c", row, "-c", "short_schedule", *words]) == 0
    run = Path("runs", row, "version_0")
    kept = yaml.safe_load((run / "config.yaml").read_text())
    schedule, given = (yaml.safe_load(path.read_text()) for path in (SCHEDULE, FOLDER / f"{row}.yaml"))
    assert kept["model"]["optimizer"]["class_path"] == schedule["model"]["optimizer"]["class_path"]
    assert kept["model"]["thinning"] == schedule["model"]["thinning"]
    assert kept["data"]["init_args"]["loader"]["batch_size"] == schedule["data"]["init_args"]["loader"]["batch_size"]
    loss = given["model"]["loss"]["init_args"]
    assert {name: kept["model"]["loss"]["init_args"][name] for name in loss} == loss  # what the row is about
    assert (run / "checkpoints" / "best.ckpt").is_file()


def test_paper_settings_are_complete():
    for name, subset, k, num_patches in (("synthetic", "Synthetic", 50, 100), ("kinect", "Kinect_v1", 150, 200)):
        config = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())
        data = config["data"]["init_args"]
        assert data["subset"] == subset
        assert data["patches"] == {"num_patches": num_patches, "patch_size": 800, "k": k}
        assert data["loader"] == {"batch_size": 10}
        assert data["val_share"] == 0  # all meshes
        assert max(config["model"]["net"]["init_args"]["k"]) == k
        assert config["trainer"]["max_epochs"] == 400
        assert config["model"]["loss"]["init_args"]["alpha"] == 0.5
        assert config["model"]["optimizer"] == {"class_path": "torch.optim.Adam", "init_args": {"lr": 1e-3}}


def test_demo_looks_at_a_mesh_that_is_held_back():
    config = yaml.safe_load((FOLDER / "demo.yaml").read_text())
    options = config["data"]["init_args"]
    options |= {"root": "data", "patches": PatchOptions(**options["patches"]), "loader": LoaderOptions()}
    names = GeneratedDataModule(**options).names
    meshes = next(entry["init_args"] for entry in config["trainer"]["callbacks"] if "meshes" in entry["init_args"])
    assert {Path(path).stem for path in meshes["meshes"]} <= {
        clean.stem for _, clean in split_pairs([(None, Path(name)) for name in names], "val", 0.1)
    }
