"""Names that others may import are pinned: adding or removing one is a decision, made in public_api.json."""

import importlib
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PINNED = json.loads((Path(__file__).parent / "public_api.json").read_text())
FOLDERS = {"dnf_pyg": ROOT / "dnf_pyg", "dnf_pyg.datamodules": ROOT / "datamodules"}
MODULES = sorted(
    ".".join([package, *path.relative_to(folder).with_suffix("").parts]).removesuffix(".__init__")
    for package, folder in FOLDERS.items()
    for path in folder.rglob("*.py")
)


@pytest.mark.parametrize("module", PINNED)
def test_names_are_those_pinned(module):
    assert sorted(importlib.import_module(module).__all__) == PINNED[module], "if it is meant: change public_api.json"


@pytest.mark.parametrize("module", MODULES)
def test_every_module_says_what_is_public(module):
    names = importlib.import_module(module).__all__
    assert len(set(names)) == len(names)
    for name in names:
        assert hasattr(importlib.import_module(module), name), f"{module}.{name}"


def test_packages_are_pinned():
    packages = {module for module in MODULES if hasattr(importlib.import_module(module), "__path__")}
    internal = {"dnf_pyg.commands", "dnf_pyg.io.formats", "dnf_pyg.nn.kernels"}
    assert packages - internal <= set(PINNED)
