"""The training commands: LightningCLI over :class:`NormalFilteringModule` and any data module by class path."""

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from lightning.fabric.utilities.exceptions import MisconfigurationException
from lightning.pytorch import Trainer
from lightning.pytorch.cli import LightningArgumentParser, LightningCLI
from lightning.pytorch.loggers import CSVLogger

from dnf_pyg.commands.class_policy import HOW, restrict_classes
from dnf_pyg.commands.configs import find_config
from dnf_pyg.commands.reasons import reason_of
from dnf_pyg.commands.run_folder import keep_curve, last_checkpoint, number_loggers, unnumbered_loggers
from dnf_pyg.errors import DataError
from dnf_pyg.train.module import NormalFilteringModule

__all__ = ["run"]


class TrainingCLI(LightningCLI):
    """LightningCLI that raises on a wrong key or value instead of printing a usage text.

    Nothing in a checkpoint is instantiated: the config says what to train, the checkpoint holds tensors and numbers.

    All loggers of a run write into one folder. With ``--ckpt_path last`` the run that wrote the newest ``last.ckpt``
    goes on in its folder: each logger would begin a new one by itself, in which Lightning finds no such checkpoint.
    """

    def init_parser(self, **kwargs: Any) -> LightningArgumentParser:
        """Make the parser of the command line."""
        return super().init_parser(**kwargs, exit_on_error=False, epilog=HOW)

    def _parse_ckpt_path(self) -> None:
        """Leave the hyperparameters of a checkpoint alone: they may name any class with any arguments."""

    def before_instantiate_classes(self) -> None:
        """Settle which folder this run writes into."""
        options = self.config[self.subcommand]
        if options.weights_only is None:
            options.weights_only = True  # Lightning runs the code in a checkpoint that it downloads otherwise
        self._numbered = unnumbered_loggers(options.trainer.logger)
        last = last_checkpoint(self._numbered) if options.ckpt_path == "last" else None
        number_loggers(self._numbered, last if self.subcommand == "fit" else None)
        if last is not None:
            options.ckpt_path = str(last)

    def instantiate_classes(self) -> None:
        """Make the objects that the config describes.

        Raises:
            DataError: If one of them refuses its arguments.
        """
        try:
            super().instantiate_classes()
        except (TypeError, ValueError, MisconfigurationException) as error:
            first: BaseException = error
            while first.__cause__ is not None:
                first = first.__cause__
            text = " ".join(str(first).split())
            if not text.startswith("Expected"):
                text = f"Expected arguments that Lightning takes (got: {text}) Change the config."
            raise DataError(text) from error

    def instantiate_trainer(self, **kwargs: Any) -> Trainer:
        """Make the trainer; the config that is kept beside its results is for any further run."""
        for logger in self._numbered:
            logger.init_args.version = None
        return super().instantiate_trainer(**kwargs)

    def before_fit(self) -> None:
        """Keep the curve of a run before this one in the same folder."""
        for logger in self.trainer.loggers:
            if isinstance(logger, CSVLogger):
                keep_curve(Path(logger.log_dir))

    before_validate = before_test = before_fit


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
            args=_with_config_paths(restrict_classes(words)),
        )
    except argparse.ArgumentError as error:
        raise DataError(f"{reason_of(error)}. See `dnf-pyg {words[0]} --help`.") from error
    except FileNotFoundError as error:
        if "Checkpoint file not found" not in str(error):
            raise
        raise DataError(f"{error}. Give the path of a checkpoint, or `last`, to --ckpt_path.") from error
    except ValueError as error:
        if "val_check_interval" not in str(error):
            raise
        raise DataError(f"{str(error).split('.')[0].strip()}. Lower it, or set it to 1.0, once an epoch.") from error


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
