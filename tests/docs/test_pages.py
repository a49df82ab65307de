"""Every code block and every command of the pages, notebooks and model cards runs, as it stands.

Only training is cut short. Cells of notebooks run elsewhere (``pytest notebooks``); here it is what their text shows.

A comment before a block says how: `<!-- not run: reason -->`, `<!-- run first: command; command -->`,
`<!-- needs: module -->` for a block that runs where this module is installed, or `<!-- file: NAME -->` for a block that
the commands after it read from a file.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from dnf_pyg.cli import main

ROOT = Path(__file__).resolve().parents[2]
PLACES = ("*.md", ".github/*.md", "docs/*.md", "docs/reference/*.md", "notebooks/*.ipynb", "dnf_pyg/weights/*/*.md")
PAGES = [page for place in PLACES for page in sorted(ROOT.glob(place))]
BLOCK = re.compile(r"((?:^<!--[^\n]*-->\n)*)^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHORT = [
    *(
        f"--trainer.{option}"
        for option in ("max_steps=1", "val_check_interval=1", "limit_val_batches=1", "limit_test_batches=1")
    ),
    "--trainer.accelerator=cpu",
    *(f"--model.net.{option}" for option in ("channels=[4,4,4]", "embedding_channels=4", "residual_k=4")),
]


def blocks(page):
    """Language, text and comments of each block."""
    shown = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(shown)["cells"]
        shown = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    for comments, language, text in BLOCK.findall(shown):
        yield language, text, dict(re.findall(r"<!-- (not run|run first|needs|file): (.*?) -->", comments))


def commands(text):
    """Commands of a block, one for each line that does not continue the one before."""
    lines = text.replace("\\\n", " ").splitlines()
    return [line for line in lines if line.strip() and not line.lstrip().startswith("#")]


def run(command):
    words = shlex.split(command, comments=True)
    if words[:2] == ["pip", "install"]:
        assert words[2].startswith("dnf-pyg"), "only this package is installed by a page"
    elif words[0] == "dnf-pyg" and not set(words) & {"|", ">", "&&"}:
        short = SHORT if words[1] in ("fit", "validate", "test") else []
        several = {"joint", "distill"} & set(words)
        keys = [f"parts.{name}.init_args." for name in ("synthetic", "kinect")] if several else [""]
        short = [*short, *(f"--data.{key}patches.num_patches=2" for key in keys if short)]
        assert main([*words[1:], *short]) == 0, command
    else:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        subprocess.run(["bash", "-ec", command], check=True, env={**os.environ, "PATH": path})


@pytest.fixture
def folder(tmp_path, monkeypatch, cnr_folder):
    """Where a page runs: with tiny meshes at the places that pages speak of."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "dnf_pyg.accessor", raising=False)  # left to PyVista to import
    shutil.copytree(cnr_folder, tmp_path / "data" / "cnr")
    (tmp_path / "my" / "clean").mkdir(parents=True)
    for part in ("clean/meshes", "clean", "noisy"):
        source = cnr_folder / "Synthetic" / "train" / ("noisy" if part == "noisy" else "original")
        shutil.copytree(source, tmp_path / "my" / part, dirs_exist_ok=True)
    return tmp_path


def test_first_screen_of_the_readme():
    first = (ROOT / "README.md").read_text().splitlines()[:25]
    for command in ("make demo", "make test"):
        assert any(line.startswith(command) for line in first)
        assert re.search(rf"^{command[5:]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert any("readme.png" in line for line in first)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_page_runs(page, folder, capsys):
    names, skipped = {}, []
    if "weights" in page.parts:  # a card is written for readers with a mesh of their own
        shutil.copy(next((folder / "my" / "noisy").iterdir()), "noisy.obj")
        run("dnf-pyg add-noise noisy.obj -o noisy.ply")
    for language, text, how in blocks(page):
        for command in how.get("run first", "").split(";"):
            if command.strip():
                run(command)
        if "not run" in how:
            skipped.append(how["not run"])
        elif "needs" in how and find_spec(how["needs"]) is None:
            continue
        elif "file" in how:
            (folder / how["file"]).write_text(text)
        elif language == "bash":
            for command in commands(text):
                run(command)
        elif language == "python":
            exec(compile(text, str(page), "exec"), names)
    for reason in skipped:
        assert len(reason) > 10, f"{page.name}: say why a block is not run"
