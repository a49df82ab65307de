"""The table of keys in docs/training.md: every key of the module and the data modules, and none that is not there."""

import inspect
import re
from pathlib import Path

import pytest
from lightning.pytorch import Trainer

import dnf_pyg.datamodules
from dnf_pyg.datamodules import JointDataModule, LoaderOptions
from dnf_pyg.datamodules.patches import PatchDataModule
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
from dnf_pyg.patches import PatchOptions
from dnf_pyg.train.distillation import Distillation
from dnf_pyg.train.losses import JointLoss
from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.settings import Thinning

PAGE = Path(__file__).resolve().parents[2] / "docs" / "training.md"
TABLES = PAGE.read_text(encoding="utf-8").partition("## Every key")[2]
KEYS = re.findall(r"^\| `([a-z_.]+)` \|", TABLES, re.MULTILINE)
MODULES = [
    module
    for module in vars(dnf_pyg.datamodules).values()
    if inspect.isclass(module) and issubclass(module, PatchDataModule | JointDataModule)
]
OWNERS = {
    "trainer": [Trainer],
    "model": [NormalFilteringModule],
    "model.net": [DNFNet, SurfaceDNFNet],
    "model.loss": [JointLoss],
    "model.distillation": [Distillation],
    "model.thinning": [Thinning],
    "data": MODULES,
    "data.patches": [PatchOptions],
    "data.loader": [LoaderOptions],
}


def arguments(owner):
    return set(inspect.signature(owner.__init__).parameters) - {"self"}


@pytest.mark.parametrize("key", KEYS)
def test_key_exists(key):
    place, _, name = key.rpartition(".")
    if place:
        assert any(name in arguments(owner) for owner in OWNERS[place])
    else:
        assert key in ("seed_everything", "ckpt_path")


@pytest.mark.parametrize("place", [place for place in OWNERS if place != "trainer"])
def test_every_key_is_explained(place):
    expected = {f"{place}.{name}" for owner in OWNERS[place] for name in arguments(owner)} - {"model.net", "model.loss"}
    assert expected <= set(KEYS)
