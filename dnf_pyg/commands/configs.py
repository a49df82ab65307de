"""List the configs that come along, or copy one to edit it; `-c NAME` finds them too."""

import argparse
import shutil
import sys
from importlib.resources import files
from pathlib import Path

from dnf_pyg.errors import DataError

__all__ = ["add_arguments", "find_config", "run"]


def packaged_configs() -> dict[str, Path]:
    """Name and file of every config that the package carries."""
    return {path.stem: path for path in sorted(Path(str(files("dnf_pyg.configs"))).glob("*.yaml"))}


def find_config(name: str) -> str:
    """Path of a config given by path or by the name of a packaged one.

    Raises:
        DataError: If it is neither.
    """
    configs = packaged_configs()
    if Path(name).is_file():
        return name
    if name.removesuffix(".yaml") not in configs:
        raise DataError(f"Expected a config file or one of {', '.join(configs)} (got '{name}'): check its name")
    return str(configs[name.removesuffix(".yaml")])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="config to print, or to copy with -o")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="file to copy it to")


def run(options: argparse.Namespace) -> None:
    """List all configs, print one, or copy one.

    Raises:
        DataError: If there is no such config, or the output exists already.
    """
    if options.name is None:
        for name, path in packaged_configs().items():
            summary = path.read_text().splitlines()[0].removeprefix("#").strip()
            sys.stdout.write(f"{name:24} {summary}\n")
        return
    path = Path(find_config(options.name))
    if options.output is None:
        sys.stdout.write(path.read_text())
    elif options.output.exists():
        raise DataError(f"Expected an output that does not exist (got {options.output}): choose another name")
    else:
        shutil.copyfile(path, options.output)
