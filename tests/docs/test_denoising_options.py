"""The table of options in docs/denoising.md: every option and every argument, and none that is not there."""

import argparse
import inspect
import re
from pathlib import Path

from dnf_pyg import denoise
from dnf_pyg.commands.denoise import add_arguments

PAGE = Path(__file__).resolve().parents[2] / "docs" / "denoising.md"
TABLE = PAGE.read_text(encoding="utf-8").partition("## What you can ask for")[2].partition("<!--")[0]
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in TABLE.splitlines() if line.startswith("| ")]


def test_every_option_is_explained():
    parser = argparse.ArgumentParser(add_help=False)
    add_arguments(parser)
    known = {option for action in parser._actions for option in action.option_strings if option.startswith("--")}
    told = [option for row in ROWS for option in re.findall(r"--[a-z][a-z-]*", row[0])]
    assert set(told) == known
    assert len(told) == len(known)


def test_every_argument_is_explained():
    told = {name for row in ROWS for name in re.findall(r"`([a-z_]+)`", row[2])}
    assert told == set(inspect.signature(denoise).parameters) - {"mesh"}
