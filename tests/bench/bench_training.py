"""Training: patches per second beside the bare forward and backward, and the share of time spent waiting for data.

The paper's network and patches (800 faces, K=50), batches of 4; meshes made in code. Medians over the steps after the
first two. Patches per processor second of the training process, which other work on the machine changes little; the
share of waiting is of the wall's time.
"""

import logging
import statistics
import tempfile
import time
import warnings
from itertools import pairwise
from pathlib import Path

import torch
import trimesh
from lightning.pytorch import Callback, Trainer, seed_everything
from lightning.pytorch.profilers import SimpleProfiler

from dnf_pyg.datamodules import CleanMeshesDataModule, LoaderOptions, PairsDataModule
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.module import NormalFilteringModule

BATCH, STEPS = 4, 12


def make_meshes(folder):
    """Two balls with dents, clean and with noise."""
    for part in ("clean", "noisy"):
        (folder / part).mkdir()
    for number in range(2):
        ball = trimesh.creation.icosphere(subdivisions=5)
        ball.vertices *= 1 + 0.1 * torch.sin(5 * torch.tensor(ball.vertices[:, [number]])).numpy()
        ball.export(folder / "clean" / f"ball{number}.ply")
        pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
        ball.vertices = GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0)).numpy()
        ball.export(folder / "noisy" / f"ball{number}_n1.ply")


class Clock(Callback):
    """Processor seconds from the end of one step to that of the next, with what loading takes of this process."""

    def __init__(self):
        self.ends = []

    def on_train_batch_end(self, *_):
        self.ends.append(time.process_time())

    def step(self):
        return statistics.median(end - start for start, end in pairwise(self.ends[1:]))


def bare(data):
    """Processor seconds of forward and backward of one batch that is there already."""
    net = DNFNet().train()
    module = NormalFilteringModule(net)
    batch = next(iter(data.train_dataloader()))
    times = []
    for _ in range(STEPS // 2):
        start = time.process_time()
        stages = net.stages(batch.x, batch.edge_index, batch.batch)
        module.loss(stages, batch.y, batch.batch).total.backward()
        net.zero_grad()
        times.append(time.process_time() - start)
    return statistics.median(times[1:])


def trained(data, folder):
    """Processor seconds of a training step, and the share of the wall's time spent waiting for its batch."""
    seed_everything(0)
    profiler, clock = SimpleProfiler(), Clock()
    trainer = Trainer(
        accelerator="cpu", max_steps=STEPS, limit_val_batches=0, logger=False, enable_checkpointing=False,
        enable_progress_bar=False, enable_model_summary=False, profiler=profiler, default_root_dir=folder,
        callbacks=[clock],
    )  # fmt: skip
    trainer.fit(NormalFilteringModule(DNFNet()), data)
    spent = profiler.recorded_durations
    wait = statistics.median(spent["[_TrainingEpochLoop].train_dataloader_next"][2:STEPS])
    return clock.step(), wait / (wait + statistics.median(spent["run_training_batch"][2:]))


def main():
    warnings.filterwarnings("ignore")
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    print("                       loading    bare fwd+bwd   training step                waiting")
    print("data                 processes patches/cpu s  patches/cpu s  of the bare   of the time")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_meshes(folder)
        options = {"patches": PatchOptions(num_patches=48), "cache": str(folder / "cache")}
        for workers in (0, 1):
            options["loader"] = LoaderOptions(batch_size=BATCH, num_workers=workers, jitter=0.0)
            for title, data in {
                "clean, fresh noise": CleanMeshesDataModule(str(folder / "clean"), **options),
                "pairs, from disk": PairsDataModule(str(folder / "noisy"), str(folder / "clean"), **options),
            }.items():
                data.prepare_data()
                floor = bare(data)
                step, waiting = trained(data, folder)
                print(
                    f"{title:<20} {workers:9}     {BATCH / floor:9.2f}      {BATCH / step:9.2f}"
                    f"  {floor / step:11.0%}   {waiting:11.1%}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
