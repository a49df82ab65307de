"""List the packaged configs, or copy one to edit it; `-c NAME` finds them, too."""

import shutil
from importlib.resources import files
from pathlib import Path

from dnf_pyg.commands.options import ConfigsOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.errors import DataError

__all__ = ["find_config", "run"]


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
        raise DataError(f"Expected a config file or one of {', '.join(configs)} (got '{name}'). Check its name.")
    return str(configs[name.removesuffix(".yaml")])


def run(options: ConfigsOptions) -> None:
    """List all configs, print one, or copy one.

    Raises:
        DataError: If there is no such config, or the output exists already.
    """
    if options.name is None:
        for name, path in packaged_configs().items():
            about, takes = (line.removeprefix("#").strip() for line in path.read_text().splitlines()[:2])
            tell(f"{name:24} {about}", f"{'':24} {takes}")
        return
    path = Path(find_config(options.name))
    if options.output is None:
        tell(*path.read_text().splitlines())
    elif options.output.exists():
        raise DataError(f"Expected a new output file (got '{options.output}', which exists). Choose another name.")
    else:
        shutil.copyfile(path, options.output)
