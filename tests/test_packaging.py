"""The wheel carries every package of the tree, one version is told everywhere, and every bound has its reason."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import trimesh
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


def test_every_extra_that_is_named_exists():
    extras = tomllib.loads(PROJECT)["project"]["optional-dependencies"]
    named = {}
    for place in ("*.md", "Makefile", "docs/**/*.md", "notebooks/*.ipynb", "configs/*.yaml", "d*/**/*.py"):
        for path in ROOT.glob(place):
            for words in re.findall(r"(?:\.|\bdnf[-_]pyg)\[([a-z,]+)\]", path.read_text(encoding="utf-8")):
                named.update(dict.fromkeys(words.split(","), path.name))
    assert {"train", "serve"} <= named.keys()
    assert {extra: place for extra, place in named.items() if extra not in extras} == {}


def built(kind, source, target):
    """Build ``sdist`` or ``wheel`` from a folder, and unpack it into another."""
    target.mkdir()
    build = f"from setuptools.build_meta import build_{kind}; build_{kind}({str(target)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=source, check=True, capture_output=True)
    (archive,) = target.iterdir()
    shutil.unpack_archive(archive, target, "gztar" if kind == "sdist" else "zip")
    return target


def test_wheel_of_the_sdist_denoises_and_shows_outside_of_the_checkout(tmp_path):
    source = tmp_path / "source"
    for name in ("dnf_pyg", "datamodules", "configs", "tests"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    (unpacked,) = (path for path in built("sdist", source, tmp_path / "sdist").iterdir() if path.is_dir())
    assert not (unpacked / "tests").exists()
    installed = built("wheel", unpacked, tmp_path / "installed")
    metadata = next(installed.glob("*.dist-info/METADATA")).read_text(encoding="utf-8")
    assert "Project-URL: Paper, https://arxiv.org" in metadata
    assert "**dnf_pyg**" in metadata
    links = re.findall(r"\]\(([^)]*)\)", metadata)
    assert links
    assert all(link.startswith("https://") for link in links)
    trimesh.creation.icosphere(subdivisions=3).export(tmp_path / "ball.ply")
    environment = {**os.environ, "PYTHONPATH": str(installed), "OMP_NUM_THREADS": "1"}
    code = "import dnf_pyg, dnf_pyg.datamodules, dnf_pyg.configs; print(dnf_pyg.__file__)"
    for words in (
        ["-c", code],
        ["-m", "dnf_pyg", "denoise", "ball.ply", "--fast", "--report", "page.html"],
        ["-m", "dnf_pyg", "configs", "demo", "-o", "demo.yaml"],
    ):
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert done.returncode == 0, done.stderr
        if words[0] == "-c":
            assert Path(done.stdout.strip()).is_relative_to(installed)
    assert (tmp_path / "ball_denoised.ply").is_file()
    assert (tmp_path / "page.html").is_file()
    assert (tmp_path / "demo.yaml").is_file()
