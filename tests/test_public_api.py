"""Names that others may import are pinned: adding or removing one is a decision, made in public_api.json."""

import importlib
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PINNED = json.loads((Path(__file__).parent / "public_api.json").read_text())
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in ("dnf_pyg", "datamodules")
    for path in (ROOT / package).rglob("*.py")
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
    packages = {module for module in MODULES if (ROOT / module.replace(".", "/")).is_dir()}
    assert packages - {"dnf_pyg.commands", "dnf_pyg.mesh.formats"} <= set(PINNED)  # these serve the package alone
