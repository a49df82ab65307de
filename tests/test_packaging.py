"""The wheel carries every package of the tree, one version is told everywhere, and every bound has its reason."""

import tomllib
from pathlib import Path

import yaml

import dnf_pyg

ROOT = Path(__file__).resolve().parents[1]
PROJECT = (ROOT / "pyproject.toml").read_text()


def test_every_package_is_listed():
    listed = tomllib.loads(PROJECT)["tool"]["setuptools"]["packages"]
    folders = {".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "dnf_pyg").rglob("__init__.py")}
    assert sorted(listed) == sorted(folders | {"dnf_pyg.configs", "dnf_pyg.datamodules"})


def test_one_version_everywhere():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"]
    assert tomllib.loads(PROJECT)["project"]["version"] == cited == dnf_pyg.__version__


def test_every_bound_has_its_reason():
    block = PROJECT.partition("\ndependencies = [\n")[2].partition("\n]")[0]
    assert len(block.splitlines()) == len(tomllib.loads(PROJECT)["project"]["dependencies"])
    assert [line for line in block.splitlines() if '",  # ' not in line] == []
