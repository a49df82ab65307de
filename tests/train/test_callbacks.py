import csv
import math

import pytest
import torch
import trimesh
from lightning.pytorch import Callback, Trainer, seed_everything
from lightning.pytorch.callbacks import EMAWeightAveraging, ModelCheckpoint
from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from matplotlib.image import imread
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from dnf_pyg import UpdateOptions, denoise
from dnf_pyg.datamodules import CleanMeshesDataModule, JointDataModule, LoaderOptions
from dnf_pyg.errors import DataError
from dnf_pyg.evaluate.metrics import MeanAngularDifference
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.callbacks import MeshValidation
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.settings import PartSettings
from dnf_pyg.weights.load import load_network


@pytest.fixture
def folder(tmp_path):
    """Three small clean meshes, and a noisy version of one beside them."""
    (tmp_path / "clean").mkdir()
    for number in range(3):
        mesh = trimesh.creation.box(extents=(1, 2, 1 + number)).subdivide().subdivide()
        mesh.export(tmp_path / "clean" / f"box{number}.ply")
    mesh.vertices += 0.03 * torch.randn(mesh.vertices.shape, generator=torch.Generator().manual_seed(0)).numpy()
    mesh.export(tmp_path / "noisy.ply")
    return tmp_path


class Losses(Callback):
    def __init__(self):
        self.values = []

    def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
        self.values.append(float(outputs["loss"]))


def data(folder, num_patches=4, jitter=0.0, **options):
    return CleanMeshesDataModule(
        str(folder / "clean"),
        patches=PatchOptions(num_patches, 40, k=8),
        loader=LoaderOptions(batch_size=4, jitter=jitter),
        val_share=0.34,
        cache=str(folder / "cache"),
        **options,
    )


def net():
    return DNFNet(k=(3, 5, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4)


def fit(folder, callbacks, epochs=2, logger=False, source=None, **options):
    seed_everything(0)
    module, losses = NormalFilteringModule(net(), **options), Losses()
    trainer = Trainer(
        accelerator="cpu", max_epochs=epochs, logger=logger, callbacks=[*callbacks, losses], log_every_n_steps=1,
        enable_progress_bar=False, enable_model_summary=False, default_root_dir=folder,
    )  # fmt: skip
    trainer.fit(module, source or data(folder))
    return trainer, module, losses.values


def theta_of(weights, folder):
    noisy, clean = read_mesh(folder / "noisy.ply"), read_mesh(folder / "clean" / "box2.ply")
    metric = MeanAngularDifference()
    result = denoise(noisy.mesh, weights, update=UpdateOptions(max_excess=math.inf))
    normal = face_normals(result.pos, clean.face)
    metric.update(normal, face_normals(clean.pos, clean.face))
    return float(metric.compute())


def pair(folder):
    return str(folder / "noisy.ply"), str(folder / "clean" / "box2.ply")


def test_logs_theta_of_each_mesh_and_their_mean(folder):
    callback = MeshValidation([pair(folder), str(folder / "clean" / "box0.ply")])
    trainer, module, _ = fit(folder, [callback], logger=CSVLogger(folder), epochs=1)
    values = trainer.callback_metrics
    own, other = float(values["val/mesh_theta/noisy"]), float(values["val/mesh_theta/box0"])
    assert own == pytest.approx(theta_of(module.net.eval(), folder), rel=1e-5)
    assert float(values["val/mesh_theta"]) == pytest.approx((own + other) / 2)
    picture = next(folder.rglob("noisy-epoch=0-step=2.png"))
    assert picture.parent.name == "mesh_errors"
    assert imread(picture).std() > 0.1


def test_pictures_go_to_tensorboard(folder):
    trainer, _, _ = fit(folder, [MeshValidation([pair(folder)])], logger=TensorBoardLogger(folder), epochs=2)
    events = EventAccumulator(trainer.logger.log_dir).Reload()
    assert [event.step for event in events.Images("mesh_errors/noisy")] == [2, 4]
    assert len(events.Scalars("val/mesh_theta")) == 2
    assert not list(folder.rglob("*.png"))


def test_training_is_as_without_it(folder):
    options = {"num_patches": 5, "jitter": 0.01}
    _, module, losses = fit(folder, [MeshValidation([pair(folder)])], source=data(folder, **options))
    _, plain, expected = fit(folder, [], source=data(folder, **options))
    assert losses == expected
    assert all(torch.equal(a, b) for a, b in zip(module.net.parameters(), plain.net.parameters(), strict=True))


@pytest.mark.parametrize("first", [True, False])
def test_averaged_weights_are_what_is_denoised_and_saved(folder, first):
    callback, averages = MeshValidation([pair(folder)]), EMAWeightAveraging(decay=0.8)
    last = ModelCheckpoint(folder / "out", filename="net")
    order = [callback, averages] if first else [averages, callback]
    trainer, _, _ = fit(folder, [*order, last], epochs=3)
    expected = theta_of(load_network(folder / "out" / "net.ckpt"), folder)
    assert float(trainer.callback_metrics["val/mesh_theta"]) == pytest.approx(expected, rel=1e-5)


def test_statistics_of_normalization_are_averaged_too(folder):
    steps = []

    class Steps(Callback):
        def on_train_batch_end(self, trainer, module, outputs, batch, batch_idx):
            steps.append({key: value.clone() for key, value in module.net.state_dict().items()})

    fit(folder, [Steps(), EMAWeightAveraging(decay=0.8), ModelCheckpoint(folder / "out", filename="net")], epochs=3)
    saved = load_network(folder / "out" / "net.ckpt").state_dict()
    keys = [key for key, value in saved.items() if value.is_floating_point()]
    assert any(key.endswith("running_mean") for key in keys)
    assert any(key.endswith("running_var") for key in keys)
    for key in keys:
        expected = steps[0][key]
        for step in steps[1:]:
            expected = 0.8 * expected + 0.2 * step[key]
        torch.testing.assert_close(saved[key], expected)


def test_only_every_nth_epoch_and_when_validating(folder):
    callback = MeshValidation([pair(folder)], every_n_epochs=2)
    trainer, module, _ = fit(folder, [callback], logger=CSVLogger(folder), epochs=5)
    with open(f"{trainer.logger.log_dir}/metrics.csv") as file:
        rows = [row["epoch"] for row in csv.DictReader(file) if row["val/mesh_theta"]]
    assert rows == ["1", "3"]
    assert "val/mesh_theta" in trainer.validate(module, data(folder), verbose=False)[0]
    again = MeshValidation([pair(folder)], every_n_epochs=2)
    again.load_state_dict(callback.state_dict())
    assert again.state_dict() == {"last_epoch": 5}


def test_uses_neighbours_and_statistics_of_one_data_set(folder):
    parts = {"near": data(folder), "far": data(folder, noise_level=(0.8, 0.9))}
    callback = MeshValidation([pair(folder)], data_set="near")
    averages = EMAWeightAveraging(decay=0.5)
    options = {"source": JointDataModule(parts), "separate_statistics": ["near", "far"], "epochs": 2}
    options["parts"] = {"near": PartSettings([2, 3, 4])}
    trainer, module, _ = fit(folder, [averages, callback], **options)
    value = float(trainer.callback_metrics["val/mesh_theta"])
    assert value == pytest.approx(theta_of(module.network_for("near"), folder), rel=1e-5)
    assert value != pytest.approx(theta_of(module.network_for("far"), folder), rel=1e-3)


def test_wrong_meshes_are_told_at_the_start(folder):
    with pytest.raises(DataError, match=r"no file .*absent\.obj"):
        fit(folder, [MeshValidation([str(folder / "absent.obj")])])
    trimesh.creation.icosphere(1).export(folder / "other.ply")
    with pytest.raises(DataError, match="same faces"):
        fit(folder, [MeshValidation([(pair(folder)[0], str(folder / "other.ply"))])])
    with pytest.raises(DataError, match="at least one mesh"):
        MeshValidation([])
    with pytest.raises(ValueError, match=r"at least 1 \(got 0\)"):
        MeshValidation(["mesh.obj"], every_n_epochs=0)
