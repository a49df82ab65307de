"""The training commands: LightningCLI over :class:`NormalFilteringModule` and any data module by class path."""

import argparse
import warnings
from collections.abc import Sequence
from typing import Any

import torch
from lightning.pytorch.cli import LightningArgumentParser, LightningCLI

from dnf_pyg.commands.configs import find_config
from dnf_pyg.errors import DataError
from dnf_pyg.module import NormalFilteringModule

__all__ = ["run"]


class TrainingCLI(LightningCLI):
    """LightningCLI that raises on a wrong key or value instead of printing a usage text."""

    def init_parser(self, **kwargs: Any) -> LightningArgumentParser:
        """Make the parser of the command line."""
        return super().init_parser(**kwargs, exit_on_error=False)


def run(words: Sequence[str]) -> None:
    """Run ``fit``, ``validate`` or ``test``.

    Args:
        words: The subcommand and its arguments; ``-c`` takes a file or the name of a packaged config.

    Raises:
        DataError: If the config or an argument is wrong.
    """
    for harmless in (
        "LightningCLI's args parameter",
        ".*LeafSpec",
        "Experiment logs directory",
        "Checkpoint directory",
    ):
        warnings.filterwarnings("ignore", message=harmless)
    torch.set_float32_matmul_precision("high")
    try:
        TrainingCLI(
            NormalFilteringModule,
            subclass_mode_data=True,
            seed_everything_default=0,
            save_config_kwargs={"overwrite": True},  # relaunching into the same folder continues there
            args=_with_config_paths(words),
        )
    except argparse.ArgumentError as error:
        raise DataError(f"{error}: see `dnf-pyg {words[0]} --help`") from error
    except FileNotFoundError as error:
        if "Checkpoint file not found" not in str(error):
            raise
        raise DataError(f"{error}: give the path of a checkpoint, or `last`, to --ckpt_path") from error
    except ValueError as error:
        if "val_check_interval" not in str(error):
            raise
        raise DataError(f"{str(error).split('.')[0].strip()}: lower it, or set it to 1.0, once an epoch") from error


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
