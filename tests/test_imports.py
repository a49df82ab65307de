"""Imports inside the package point one way."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = {
    "__init__": {"errors", "options", "pipeline", "weights"},
    "errors": set(),
    "findings": set(),
    "options": {"errors"},
    "progress": set(),
    "mesh": {"errors"},
    "nn": {"errors"},
    "io": {"errors", "mesh"},
    "patches": {"errors", "mesh"},
    "synthetic": {"errors", "mesh"},
    "transforms": {"errors", "mesh", "patches"},
    "datasets": {"errors", "io", "mesh", "patches", "transforms"},
    "weights": {"errors", "nn", "options"},
    "filtering": {"errors", "mesh", "nn", "options", "patches", "progress"},
    "steps": {"filtering", "mesh", "nn", "options", "patches", "progress"},
    "pipeline": {
        "errors",
        "filtering",
        "findings",
        "io",
        "mesh",
        "nn",
        "options",
        "progress",
        "result",
        "steps",
        "weights",
    },
    "result": {"errors", "io", "mesh", "options", "view"},
    "accessor": {"pipeline"},
    "view": {"errors", "io", "mesh", "options"},
    "evaluate": {"datasets", "errors", "io", "mesh", "options", "pipeline", "view", "weights"},
    "train": {"errors", "evaluate", "io", "mesh", "nn", "options", "pipeline", "view", "weights"},
    "datamodules": {
        "datasets",
        "errors",
        "io",
        "mesh",
        "options",
        "patches",
        "pipeline",
        "synthetic",
        "transforms",
        "weights",
    },
}
TOP = {"__main__", "cli", "commands"}  # may import everything, and only each other imports them
NO_LIGHTNING = {"datasets", "filtering", "mesh", "nn", "patches", "pipeline"}
FILES = sorted([*(ROOT / "dnf_pyg").rglob("*.py"), *(ROOT / "datamodules").rglob("*.py")])


def unit_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[0] if parts[0] == "datamodules" else parts[1]


def imported_modules(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_one_way(path):
    unit = unit_of(path)
    for module in imported_modules(path):
        parts = module.split(".")
        if unit in NO_LIGHTNING:
            assert parts[0] not in ("lightning", "pytorch_lightning"), f"{unit} must work without Lightning"
        if unit not in TOP and parts[0] == "dnf_pyg":
            other = parts[1] if len(parts) > 1 else "__init__"
            assert other in ALLOWED[unit] | {unit}, f"{unit} must not import {other}"


def test_every_unit_has_a_rule():
    assert {unit_of(path) for path in FILES} == set(ALLOWED) | TOP


@pytest.mark.parametrize(("lower", "higher"), [("baselines", "benchmark"), ("benchmark", "experiments")])
def test_evaluation_builds_on_what_lies_below(lower, higher):
    for path in (ROOT / "dnf_pyg" / "evaluate" / lower).rglob("*.py"):
        assert not any(module.startswith(f"dnf_pyg.evaluate.{higher}") for module in imported_modules(path)), path
