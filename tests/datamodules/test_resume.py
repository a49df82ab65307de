"""A run killed in the middle of an epoch and resumed has the loss curve of an unbroken run."""

import csv
import os
import signal
import subprocess
import sys
import textwrap

import pytest

SCRIPT = textwrap.dedent(
    """
    import os, signal, sys
    import torch
    from lightning.pytorch import Callback, Trainer, seed_everything
    from lightning.pytorch.callbacks import ModelCheckpoint
    from dnf_pyg.datamodules import CleanMeshesDataModule, LoaderOptions
    from dnf_pyg.patches import PatchOptions
    from dnf_pyg.train.module import NormalFilteringModule
    from dnf_pyg.nn import DNFNet

    root, out, kill_at, workers = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])

    class Curve(Callback):
        def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
            with open(out + "/curve.csv", "a") as file:
                file.write(f"{trainer.global_step},{float(outputs['loss']):.9e}\\n")
            if trainer.global_step == kill_at:
                os.kill(os.getpid(), signal.SIGKILL)

    torch.set_num_threads(1)
    seed_everything(0)
    loader = LoaderOptions(batch_size=2, num_workers=workers, jitter=0.005)
    data = CleanMeshesDataModule(root, patches=PatchOptions(6, 40, k=8), loader=loader, val_share=0.3)
    module = NormalFilteringModule(DNFNet(k=(3, 5, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4))
    last = ModelCheckpoint(out, save_last=True, every_n_train_steps=3, save_top_k=0)
    trainer = Trainer(accelerator="cpu", max_epochs=3, callbacks=[last, Curve()], logger=False,
                      enable_progress_bar=False, enable_model_summary=False, default_root_dir=out)
    trainer.fit(module, data, ckpt_path="last" if os.path.exists(out + "/last.ckpt") else None, weights_only=True)
    """
)


def run(root, out, kill_at=-1, workers=0):
    out.mkdir(exist_ok=True)
    command = [sys.executable, "-c", SCRIPT, str(root), str(out), str(kill_at), str(workers)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})


def curve(out):
    with (out / "curve.csv").open() as file:
        return {int(step): float(loss) for step, loss in csv.reader(file)}  # steps done again overwrite


@pytest.mark.parametrize(("kill_at", "workers"), [(5, 0), (5, 1), (8, 1)])
def test_killed_and_resumed_has_the_same_curve(clean_folder, tmp_path, kill_at, workers):
    whole = run(clean_folder, tmp_path / "whole")
    assert whole.returncode == 0, whole.stderr
    killed = run(clean_folder, tmp_path / "killed", kill_at, workers)
    assert killed.returncode == -signal.SIGKILL
    resumed = run(clean_folder, tmp_path / "killed", workers=workers)
    assert resumed.returncode == 0, resumed.stderr
    assert len(curve(tmp_path / "whole")) == 18
    assert curve(tmp_path / "killed") == pytest.approx(curve(tmp_path / "whole"), abs=1e-6)
