"""The training commands: LightningCLI over :class:`NormalFilteringModule` and any data module by class path."""

from collections.abc import Sequence

import torch
from lightning.pytorch.cli import LightningArgumentParser, LightningCLI

from dnf_pyg.commands.configs import find_config
from dnf_pyg.errors import DataError
from dnf_pyg.module import NormalFilteringModule

__all__ = ["run"]


class _OneLineErrors(LightningArgumentParser):
    """Report a wrong key or value as one typed error instead of a usage text."""

    def error(self, message: str, ex: Exception | None = None) -> None:
        raise DataError(f"{message}: see `dnf-pyg fit --help`") from ex


class TrainingCLI(LightningCLI):
    """LightningCLI whose errors are :class:`DataError`."""

    def init_parser(self, **kwargs: object) -> LightningArgumentParser:
        """Make the parser of the command line."""
        return _OneLineErrors(**kwargs)


def run(words: Sequence[str]) -> None:
    """Run ``fit``, ``validate``, ``test`` or ``predict``.

    Args:
        words: The subcommand and its arguments; ``-c`` takes a file or the name of a packaged config.

    Raises:
        DataError: If the config or an argument is wrong.
    """
    torch.set_float32_matmul_precision("high")
    TrainingCLI(
        NormalFilteringModule,
        subclass_mode_data=True,
        seed_everything_default=0,
        save_config_kwargs={"overwrite": True},  # relaunching into the same folder continues there
        args=_with_config_paths(words),
    )


def _with_config_paths(words: Sequence[str]) -> list[str]:
    paths = []
    for position, word in enumerate(words):
        option, equals, value = word.partition("=")
        if option == "--config" and equals:
            paths.append(f"--config={find_config(value)}")
        elif position and words[position - 1] in ("-c", "--config"):
            paths.append(find_config(word))
        else:
            paths.append(word)
    return paths
