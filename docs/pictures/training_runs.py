"""Small real runs whose curves docs/training.md shows: minutes on one core.

Arguments: the CNR benchmark (its Synthetic/train/original is trained on), and a folder for the runs. Runs that are
there already are kept. `training_curves.py` draws them.
"""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

NET = {"k": [6, 12, 20], "residual_k": 8, "channels": [16, 32, 64], "embedding_channels": 32}
MANY = """
cad gear gem boat blob torus_knot spot fish terrain koala airplane penguin skull tee_pipe housing lbracket hexnut
scorpion steps_ramp twist_prism
""".split()  # noqa: SIM905 - a text of names reads better than quotes around each
MESHES = MANY[:10]


def clean_meshes(root, folder, names=MESHES, num_patches=30, k=20, batch_size=4, jitter=0.0):
    arguments = {
        "root": str(root),
        "names": names,
        "noise_level": [0.1, 0.3],
        "patches": {"num_patches": num_patches, "patch_size": 300, "k": k},
        "loader": {"batch_size": batch_size, "rotate": False, "jitter": jitter},
        "cache": str(folder / "patches"),
    }
    return {"class_path": "dnf_pyg.datamodules.CleanMeshesDataModule", "init_args": arguments}


def config(folder, name, data, max_steps, net=None, callbacks=(), checkpoint=None, **model):
    """A run of `dnf-pyg fit`, complete."""
    last = {"dirpath": str(folder / name), "save_last": True, "enable_version_counter": False}
    last |= checkpoint or {"filename": "best", "monitor": "val/theta", "mode": "min"}
    logger = {"save_dir": str(folder), "name": name, "version": "", "flush_logs_every_n_steps": 1}
    return {
        "seed_everything": 0,
        "trainer": {
            "max_steps": max_steps,
            "accelerator": "cpu",
            "log_every_n_steps": 1,
            "enable_progress_bar": False,
            "logger": {"class_path": "lightning.pytorch.loggers.CSVLogger", "init_args": logger},
            "callbacks": [{"class_path": "lightning.pytorch.callbacks.ModelCheckpoint", "init_args": last}, *callbacks],
        },
        "model": {
            "net": {"class_path": "dnf_pyg.nn.DNFNet", "init_args": {**NET, **(net or {})}},
            "loss": {"class_path": "dnf_pyg.train.losses.JointLoss", "init_args": {"alpha": 0.01}},
            "optimizer": {"class_path": "torch.optim.Adam", "init_args": {"lr": 3.0e-3}},
            "scheduler": {
                "class_path": "torch.optim.lr_scheduler.CosineAnnealingLR",
                "init_args": {"T_max": max_steps},
            },
            "scheduler_interval": "step",
            **model,
        },
        "data": data,
    }


def start(folder, name, content, *words):
    """Start a run; its configuration lies beside its results."""
    (folder / name).mkdir(parents=True, exist_ok=True)
    path = folder / name / "run.yaml"
    path.write_text(yaml.safe_dump(content))
    with (folder / name / "run.log").open("w") as log:
        command = [str(Path(sys.executable).with_name("dnf-pyg")), "fit", "-c", str(path), *words]
        return subprocess.Popen(command, stdout=log, stderr=log)


def run(folder, name, content, *words):
    if (folder / name / "done").exists():
        return
    begun = time.perf_counter()
    if start(folder, name, content, *words).wait():
        raise SystemExit((folder / name / "run.log").read_text()[-2000:])
    (folder / name / "done").touch()
    spent = sum(os.times()[2:4])
    print(f"{name}: {time.perf_counter() - begun:.0f} s; processor time of all so far {spent:.0f} s", flush=True)


def last_step(table):
    """Last step that a table of a CSVLogger holds; -1 if it is not there yet."""
    if not table.is_file():
        return -1
    steps = [row["step"] for row in csv.DictReader(table.read_text().splitlines()) if row.get("step")]
    return int(steps[-1]) if steps else -1


def run_killed(folder, name, content, at_step):
    """Kill a run with signal 9 in the middle of an epoch."""
    if (folder / name / "done").exists():
        return
    process, table = start(folder, name, content), folder / name / "metrics.csv"
    while process.poll() is None and last_step(table) < at_step:
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    if process.wait() != -signal.SIGKILL:
        raise SystemExit((folder / name / "run.log").read_text()[-2000:])
    (folder / name / "done").touch()


def compare_optimizers(data, folder):
    """The network of `small` with each optimizer: the same patches, and a rate that is constant and then falls."""
    patches = clean_meshes(data, folder, MANY, num_patches=30, k=16)
    patches["init_args"] |= {"val_share": 0.2, "fresh": True}
    patches["init_args"]["patches"]["patch_size"] = 500
    for name, optimizer, rate in (
        ("adamw_2e-3", "torch.optim.AdamW", 2.0e-3),
        ("adamw_4e-3", "torch.optim.AdamW", 4.0e-3),
        ("muon_4e-3", "dnf_pyg.train.muon.MuonAdamW", 4.0e-3),
    ):
        schedule = {"warmup_steps": 50, "decay_start": 400, "total_steps": 800}
        content = config(
            folder, name, patches, 800,
            net={"k": [8, 16, 16], "num_units": 1, "channels": [32, 64, 64], "embedding_channels": 64},
            optimizer={"class_path": optimizer, "init_args": {"lr": rate, "weight_decay": 1.0e-4}},
            scheduler={"class_path": "dnf_pyg.train.schedule.WarmupStableDecay", "init_args": schedule},
        )  # fmt: skip
        content["model"]["net"]["class_path"] = "dnf_pyg.nn.SurfaceDNFNet"
        content["trainer"] |= {"val_check_interval": 100, "check_val_every_n_epoch": None, "gradient_clip_val": 1.0}
        run(folder, name, content)


def main():
    data, folder = Path(sys.argv[1]) / "Synthetic" / "train" / "original", Path(sys.argv[2]).resolve()
    validation = {
        "class_path": "dnf_pyg.train.callbacks.MeshValidation",
        "init_args": {"meshes": [str(data / "gem.obj")], "every_n_epochs": 2},  # held back
    }
    run(folder, "real", config(folder, "real", clean_meshes(data, folder), 600, callbacks=[validation]))

    views = {"root": str(data), "names": ["spot", "fish", "blob", "gear"], "cache": str(folder / "views")}
    views |= {"num_views": 2, "patches": {"num_patches": 40, "patch_size": 300, "k": 30}}
    views["loader"] = {"batch_size": 4, "rotate": False}
    parts = {
        "gaussian": clean_meshes(data, folder, k=12),
        "kinect": {"class_path": "dnf_pyg.datamodules.DepthCameraDataModule", "init_args": views},
    }
    joint = {"class_path": "dnf_pyg.datamodules.JointDataModule", "init_args": {"parts": parts}}
    wide = {"k": [10, 20, 30]}
    uses = {"gaussian": {"k": [4, 8, 12]}, "kinect": {"k": [10, 20, 30]}}
    options = {"net": wide, "parts": uses, "separate_statistics": ["gaussian", "kinect"]}
    run(folder, "joint", config(folder, "joint", joint, 350, **options))

    few = clean_meshes(data, folder, ["cad", "gem", "blob", "spot"], num_patches=24, jitter=0.005)
    often = {"save_top_k": 0, "every_n_train_steps": 10}
    run(folder, "unbroken", config(folder, "unbroken", few, 90, checkpoint=often))
    run_killed(folder, "killed", config(folder, "killed", few, 90, checkpoint=often), at_step=46)
    again = config(folder, "resumed", few, 90, checkpoint=often)
    again["ckpt_path"] = str(folder / "killed" / "last.ckpt")
    run(folder, "resumed", again)

    for name, batch_size, words in (
        ("processes_1", 8, []),
        ("processes_2", 4, ["--trainer.devices=2", "--trainer.strategy=ddp"]),
        ("accumulated", 4, ["--trainer.accumulate_grad_batches=2"]),
    ):
        shared = clean_meshes(data, folder, ["cad", "gem", "blob", "spot"], num_patches=16, batch_size=batch_size)
        run(folder, name, config(folder, name, shared, 120), *words)

    compare_optimizers(data, folder)


if __name__ == "__main__":
    main()
