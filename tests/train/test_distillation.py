import copy

import pytest
import torch
import trimesh
from lightning.pytorch import Trainer, seed_everything
from lightning.pytorch.callbacks import EMAWeightAveraging
from torch_geometric.data import Batch, Data

from dnf_pyg.datamodules import CleanMeshesDataModule, JointDataModule, LoaderOptions
from dnf_pyg.errors import DataError, WeightsError
from dnf_pyg.nn import DNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.distillation import Distillation
from dnf_pyg.train.losses import JointLoss
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.settings import PartSettings
from dnf_pyg.weights.load import load_network

SMALL = {"residual_k": 3, "channels": (8, 8, 8), "embedding_channels": 8}


@pytest.fixture
def teachers(tmp_path):
    """Weights of two networks by data set; the second looks further."""
    for number, (name, k) in enumerate({"near": (2, 3, 4), "far": (3, 5, 8)}.items()):
        torch.manual_seed(number)
        DNFNet(k=k, **SMALL).save_pretrained(tmp_path / name)
    return {name: str(tmp_path / name) for name in ("near", "far")}


@pytest.fixture
def batch():
    torch.manual_seed(3)
    normal, clean = (torch.nn.functional.normalize(torch.randn(20, 3), dim=-1) for _ in range(2))
    near = torch.stack([torch.arange(20), *torch.randint(20, (7, 20))]).t().flatten()
    edge_index = torch.stack([near, torch.arange(20).repeat_interleave(8)])
    rank = torch.arange(8).repeat(20)
    return Batch.from_data_list([Data(x=normal, y=clean, edge_index=edge_index, edge_attr=rank)] * 2)


def joint(tmp_path, ks=(4, 8)):
    (tmp_path / "clean").mkdir(exist_ok=True)
    for number in range(2):
        box = trimesh.creation.box(extents=(1, 2, 1 + number)).subdivide().subdivide()
        box.export(tmp_path / "clean" / f"box{number}.ply")
    parts = {
        name: CleanMeshesDataModule(
            str(tmp_path / "clean"), patches=PatchOptions(3, 30, k=k), loader=LoaderOptions(batch_size=2)
        )
        for name, k in zip(("near", "far"), ks, strict=True)
    }
    return JointDataModule(parts)


def trainer(tmp_path, *callbacks):
    return Trainer(
        accelerator="cpu", max_epochs=1, logger=False, callbacks=list(callbacks), enable_progress_bar=False,
        enable_model_summary=False, default_root_dir=tmp_path,
    )  # fmt: skip


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_loss_is_that_of_the_formula(teachers, batch, weight):
    distillation, loss = Distillation(teachers, weight), JointLoss(alpha=0.5)
    student = DNFNet(k=(2, 4, 6), **SMALL)
    stages = student.stages(**student.gather(batch))
    terms = distillation(loss(stages, batch.y, batch.batch), loss, stages, "far", batch)
    with torch.no_grad():
        teacher = load_network(teachers["far"])
        target = teacher(**teacher.gather(batch))
    recovery = residual = 0.0
    for normal, feature in stages:  # both patches have as many faces: the mean over faces is that over patches
        towards = [(normal - wanted).square().sum(dim=1).mean() for wanted in (batch.y, target)]
        recovery += (1 - weight) * towards[0] + weight * towards[1]
        residual += feature.square().sum(dim=1).mean()
    torch.testing.assert_close(terms.recovery, recovery)
    torch.testing.assert_close(terms.total, recovery + 0.5 * residual)
    terms.total.backward()
    assert all(parameter.grad is not None for parameter in student.parameters())


def test_teachers_stay_as_they_are_and_out_of_the_checkpoint(teachers, tmp_path):
    seed_everything(0)
    distillation = Distillation(teachers)
    before = copy.deepcopy({name: net.state_dict() for name, net in distillation.networks.items()})
    student = NormalFilteringModule(
        DNFNet(k=(3, 5, 8), **SMALL), distillation=distillation, parts={"near": PartSettings([2, 3, 4])}
    )
    fitting = trainer(tmp_path, EMAWeightAveraging(decay=0.5))
    fitting.fit(student, joint(tmp_path))
    for name, net in distillation.networks.items():
        assert not net.training
        assert not any(parameter.requires_grad or parameter.grad is not None for parameter in net.parameters())
        for key, value in net.state_dict().items():
            assert torch.equal(value, before[name][key])
    path = tmp_path / "student.ckpt"
    fitting.save_checkpoint(path)
    loaded = load_network(path)
    for key, value in student.net.state_dict().items():
        torch.testing.assert_close(loaded.state_dict()[key], value)
    size = sum(value.numel() for value in torch.load(path, weights_only=True)["state_dict"].values())
    assert size == sum(value.numel() for value in student.net.state_dict().values())


def test_teacher_only_counts_while_training(teachers, tmp_path):
    options = {"net": DNFNet(k=(3, 5, 8), **SMALL), "parts": {"near": PartSettings([2, 3, 4])}}
    module = NormalFilteringModule(**options, distillation=Distillation(teachers, weight=1.0))
    plain = NormalFilteringModule(**options)
    values = [trainer(tmp_path).validate(one, joint(tmp_path), verbose=False)[0] for one in (module, plain)]
    assert values[0] == values[1]


def test_missing_teacher(teachers):
    with pytest.raises(WeightsError, match="got 'nonesuch'"):
        Distillation({"near": "nonesuch"})
    assert Distillation({"near": "single"}).networks["near"].k == load_network("single").k
    with pytest.raises(ValueError, match="at least one teacher"):
        Distillation({})
    with pytest.raises(ValueError, match=r"from 0 to 1 \(got 2\)"):
        Distillation(teachers, weight=2)


def test_teachers_and_data_sets_that_do_not_fit(teachers, tmp_path):
    alone = NormalFilteringModule(DNFNet(k=(2, 3, 4), **SMALL), distillation=Distillation({"near": teachers["near"]}))
    with pytest.raises(DataError, match=r"teachers for \['near'\], data sets \['far', 'near'\]"):
        trainer(tmp_path).fit(alone, joint(tmp_path))
    both = NormalFilteringModule(DNFNet(k=(2, 3, 4), **SMALL), distillation=Distillation(teachers))
    with pytest.raises(DataError, match="'far' with the 8 neighbours that its teacher uses"):
        trainer(tmp_path).fit(both, joint(tmp_path, ks=(4, 6)))
