"""Two processes with gloo train on the same batches, and reach the same losses, as one with the same global batch."""

import json
import subprocess
import sys
import textwrap

import pytest
import torch
import trimesh

SCRIPT = textwrap.dedent(
    """
    import atexit, json, pathlib, sys

    def threads():
        return [path.read_text() for path in pathlib.Path("/proc/self/task").glob("*/comm")].count("pt_gloo_runloop\\n")

    @atexit.register  # before anything else: called last
    def count_threads():
        with open(f"{out}/threads-{processes}-{trainer.global_rank}.json", "w") as file:
            json.dump({"running": running, "left": threads()}, file)

    import torch
    from lightning.pytorch import Callback, Trainer, seed_everything
    from dnf_pyg.datamodules import CleanMeshesDataModule, LoaderOptions
    from dnf_pyg.train.callbacks import MeshValidation
    from dnf_pyg.datasets import mesh_dataset
    from dnf_pyg.patches import PatchOptions
    from dnf_pyg.train.module import NormalFilteringModule
    from dnf_pyg.nn import DNFNet

    root, cache, out, processes = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])

    class Record(Callback):
        rows = []

        def on_train_batch_start(self, trainer, module, batch, batch_idx):
            module.net.eval()  # batch statistics belong to a process; the loss must not depend on them here

        def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
            self.rows.append([float(outputs["loss"]), *batch.x.view(-1, 40 * 3).sum(1).tolist()])

        def on_fit_end(self, trainer, module):
            with open(f"{out}/{processes}-{trainer.global_rank}.json", "w") as file:
                json.dump(self.rows, file)

    prepared, write_entry = [], mesh_dataset.write_entry
    mesh_dataset.write_entry = lambda folder, arrays: (prepared.append(folder.name), write_entry(folder, arrays))
    torch.set_num_threads(1)
    seed_everything(0)
    loader = LoaderOptions(batch_size=4 // processes, jitter=0.0)
    data = CleanMeshesDataModule(root, patches=PatchOptions(8, 40, k=8), loader=loader, val_share=0.3, cache=cache)
    module = NormalFilteringModule(DNFNet(k=(3, 5, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4))
    trainer = Trainer(accelerator="cpu", devices=processes, strategy="ddp" if processes > 1 else "auto", max_epochs=2,
                      callbacks=[Record(), MeshValidation([f"{root}/box0.obj"], every_n_epochs=2)], logger=False,
                      enable_progress_bar=False, enable_model_summary=False, enable_checkpointing=False,
                      default_root_dir=f"{out}/{processes}")
    trainer.fit(module, data)
    mesh_theta = float(trainer.callback_metrics["val/mesh_theta"])
    data.patches = PatchOptions(7, 40, k=8)  # not a multiple of the processes
    theta = trainer.test(module, data, verbose=False)[0]["test/theta"]
    with open(f"{out}/theta-{processes}-{trainer.global_rank}.json", "w") as file:
        json.dump({"test": theta, "mesh": mesh_theta, "prepared": sorted(prepared)}, file)
    running = threads()
    """
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where one process and two have trained on the same three meshes, with what each wrote down."""
    folder = tmp_path_factory.mktemp("parallel")
    (folder / "clean").mkdir()
    for number in range(3):
        mesh = trimesh.creation.box(extents=(1, 2, 1 + number)).subdivide().subdivide()
        mesh.export(folder / "clean" / f"box{number}.obj")
    script = folder / "train.py"
    script.write_text(SCRIPT)
    for processes in (1, 2):
        command = [sys.executable, script, folder / "clean", folder / f"cache-{processes}", folder, str(processes)]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stderr
    return folder


def read(folder, *names):
    return [json.loads((folder / f"{name}.json").read_text()) for name in names]


def test_no_thread_of_the_processes_is_left_at_the_end(folder):
    one, first, second = read(folder, "threads-1-0", "threads-2-0", "threads-2-1")
    assert one["running"] == 0
    for values in (first, second):  # else such a thread aborts the process now and then
        assert values["running"] > 0 or sys.platform != "linux"
        assert values["left"] == 0


def test_one_process_prepares_for_all(folder):
    alone, first, second = (values["prepared"] for values in read(folder, "theta-1-0", "theta-2-0", "theta-2-1"))
    assert [name.partition("-")[0] for name in first] == ["box0", "box1", "box1", "box2"]  # box1 again for the test
    assert first == alone
    assert second == []


def test_padding_is_not_counted(folder):
    thetas = [values["test"] for values in read(folder, "theta-1-0", "theta-2-0", "theta-2-1")]
    assert thetas == pytest.approx([thetas[0]] * 3, rel=1e-4)


def test_meshes_are_denoised_once_and_every_process_knows(folder):
    thetas = [values["mesh"] for values in read(folder, "theta-1-0", "theta-2-0", "theta-2-1")]
    assert thetas[1] == thetas[2]
    assert thetas[0] == pytest.approx(thetas[1], rel=1e-3)
    assert len(list((folder / "2").rglob("box0-*.png"))) == 1


def test_two_processes_share_the_batches_of_one(folder):
    one, first, second = (torch.tensor(rows, dtype=torch.float64) for rows in read(folder, "1-0", "2-0", "2-1"))
    assert one.shape == (8, 5)  # 16 patches of two meshes, four a step, two epochs
    shared = torch.cat([first[:, 1:], second[:, 1:]], dim=1)
    torch.testing.assert_close(shared.sort(1).values, one[:, 1:].sort(1).values)
    torch.testing.assert_close((first[:, 0] + second[:, 0]) / 2, one[:, 0], rtol=1e-4, atol=1e-5)
