"""Denoise many meshes with Lightning, on several processes or machines; start it again to go on where it stopped."""

import argparse
import inspect
import json
import logging
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightning.pytorch import Callback, LightningModule, Trainer
from lightning.pytorch.cli import LightningArgumentParser

from dnf_pyg.commands.class_policy import reason_of, restrict_classes
from dnf_pyg.commands.outcome import Outcome, outcome_text
from dnf_pyg.commands.settings import add_settings, denoise_settings
from dnf_pyg.datamodules import MeshFilesDataModule
from dnf_pyg.errors import DataError, DNFError
from dnf_pyg.io import SUFFIXES
from dnf_pyg.train.prediction import DenoisedFile, FailedFile, MeshDenoisingModule
from dnf_pyg.weights.load import load_network

__all__ = ["run"]

_HOW = """
Two processes: --trainer.devices 2. Two machines that see the same folders: --trainer.num_nodes 2, started on each
under `torchrun`. Outputs appear whole or not at all, and those that are there are left out, so that an interrupted
run goes on when it is started again.
"""


_WHERE = {"accelerator", "strategy", "devices", "num_nodes", "plugins", "profiler", "enable_progress_bar"}


class _Tell(Callback):
    """Print a line, or a JSON object, for every file that is done, and a line for one that failed."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    def on_predict_batch_end(self, trainer: Trainer, pl_module: LightningModule, outputs: Any, *_: Any) -> None:
        if isinstance(outputs, DenoisedFile):
            values = Outcome(*outputs, reference=None).values() | {"process": trainer.global_rank}
            sys.stdout.write(json.dumps(values) + "\n" if self.as_json else outcome_text(values))
            sys.stdout.flush()
        elif isinstance(outputs, FailedFile):
            sys.stderr.write(f"{outputs.source}: failed\n")


def run(words: Sequence[str]) -> None:
    """Denoise all inputs that have no output yet.

    Args:
        words: The name of the command and its arguments.

    Raises:
        DNFError: If an argument is wrong, or inputs failed; the outputs of the others are written.
    """
    try:
        options = _parser().parse_args(restrict_classes(words[1:]))
    except argparse.ArgumentError as error:
        raise DataError(f"{reason_of(error)}. See `dnf-pyg predict --help`.") from error
    module = MeshDenoisingModule(load_network(options.weights), denoise_settings(options))
    files = MeshFilesDataModule([str(path) for path in options.input], str(options.output), options.overwrite)
    logging.getLogger("lightning.pytorch.utilities.rank_zero").addFilter(_is_needed)
    warnings.filterwarnings("ignore", message=".*LeafSpec")
    try:
        trainer = Trainer(
            **dict(options.trainer),
            callbacks=[_Tell(options.json)],
            use_distributed_sampler=False,  # the data module shares by size
            logger=False,
            enable_checkpointing=False,
            enable_model_summary=False,
        )
    except (ValueError, RuntimeError) as error:  # Lightning's MisconfigurationException is neither typed nor exported
        raise DataError(f"Expected a trainer of this machine (got '{error}'): change --trainer") from error
    trainer.predict(module, files, return_predictions=False)
    failures = module.failures_of_all()
    if failures and trainer.is_global_zero:
        listed = "; ".join(f"{path}: {reason}" for path, reason in sorted(failures.items()))
        raise DNFError(f"{len(failures)} of {files.num_files} meshes failed: {listed}")


def _is_needed(record: logging.LogRecord) -> bool:
    """Whether Lightning tells something that a user of this command can act on."""
    return not any(text in record.getMessage() for text in ("litlogger", "available: False", "HPU"))


def _parser() -> LightningArgumentParser:
    parser = LightningArgumentParser(
        prog="dnf-pyg predict", description=f"{__doc__}\n{_HOW}", exit_on_error=False, default_env=False
    )
    add = parser.add_argument
    add("input", type=Path, nargs="+", metavar="IN", help=f"noisy meshes ({', '.join(SUFFIXES)}), or folders of them")
    add("-o", "--output", type=Path, required=True, metavar="OUT", help="folder for the results")
    add("--overwrite", action="store_true", help="do again what is there (else it is left out)")
    add("--json", action="store_true", help="print one JSON object per mesh")
    add("-c", "--config", action="config", help="YAML file with any of these options")
    add_settings(parser)
    others = set(inspect.signature(Trainer).parameters) - _WHERE
    parser.add_class_arguments(Trainer, "trainer", instantiate=False, skip=others)
    parser.set_defaults({"trainer.enable_progress_bar": sys.stderr.isatty()})
    return parser
