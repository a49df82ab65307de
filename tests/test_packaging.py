"""The wheel carries every package of the tree."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_every_package_is_listed():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = [
        path.parent.relative_to(ROOT)
        for top in ("dnf_pyg", "datamodules")
        for path in (ROOT / top).rglob("__init__.py")
    ]
    assert sorted(listed) == sorted({".".join(folder.parts) for folder in folders} | {"dnf_pyg.configs"})
