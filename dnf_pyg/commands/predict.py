"""Denoise many meshes with Lightning, on several processes or machines."""

import inspect
import json
import logging
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from lightning.fabric.utilities.exceptions import MisconfigurationException
from lightning.pytorch import Callback, LightningModule, Trainer

from dnf_pyg.commands.class_policy import restrict_classes
from dnf_pyg.commands.options import PredictOptions
from dnf_pyg.commands.outcome import Outcome, outcome_text
from dnf_pyg.commands.parser import option_parser, parse_options
from dnf_pyg.commands.terminal import tell
from dnf_pyg.datamodules import MeshFilesDataModule
from dnf_pyg.errors import DNFError, OptionError
from dnf_pyg.train.prediction import DenoisedFile, FailedFile, MeshDenoisingModule
from dnf_pyg.weights.load import load_cascade

__all__ = ["run"]

_WHERE = {"accelerator", "strategy", "devices", "num_nodes", "plugins", "profiler", "enable_progress_bar"}


class _Tell(Callback):
    """Print a line, or a JSON object, for every file that is done, and a line for every one that failed."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    def on_predict_batch_end(self, trainer: Trainer, pl_module: LightningModule, outputs: Any, *_: Any) -> None:
        if isinstance(outputs, DenoisedFile):
            values = Outcome(*outputs, reference=None).values() | {"process": trainer.global_rank}
            tell(*([json.dumps(values)] if self.as_json else outcome_text(values)))
            for warning in outputs.result.warnings:
                tell(f"warning: {values['input']}: {warning}", file=sys.stderr)
        elif isinstance(outputs, FailedFile):
            tell(f"{outputs.source}: failed", file=sys.stderr)


def run(words: Sequence[str]) -> None:
    """Denoise all inputs that have no output yet.

    Args:
        words: The name of the command and its arguments.

    Raises:
        DNFError: If an argument is wrong, or inputs failed; the outputs of the others are written.
    """
    parser = option_parser(PredictOptions, "dnf-pyg predict")
    others = set(inspect.signature(Trainer).parameters) - _WHERE
    parser.add_class_arguments(Trainer, "trainer", instantiate=False, skip=others)
    parser.set_defaults({"trainer.enable_progress_bar": sys.stderr.isatty()})
    options, found = parse_options(parser, PredictOptions, restrict_classes(words[1:]))
    net = load_cascade(options.weights, options.data_set)
    module = MeshDenoisingModule(net, options.filtering, options.update, options.num_passes)
    files = MeshFilesDataModule([str(path) for path in options.input], str(options.output), options.overwrite)
    logging.getLogger("lightning.pytorch.utilities.rank_zero").addFilter(_is_needed)
    warnings.filterwarnings("ignore", message=".*LeafSpec")
    try:
        trainer = Trainer(
            **dict(found.trainer),
            callbacks=[_Tell(options.json)],
            use_distributed_sampler=False,  # the data module shares by size
            logger=False,
            enable_checkpointing=False,
            enable_model_summary=False,
        )
    except (ValueError, RuntimeError, MisconfigurationException) as error:
        raise OptionError(f"Expected a trainer of this machine (got '{error}'). Change --trainer.") from error
    trainer.predict(module, files, return_predictions=False)
    failures = module.failures_of_all()
    if failures and trainer.is_global_zero:
        listed = "; ".join(f"{path}: {reason}" for path, reason in sorted(failures.items()))
        raise DNFError(f"{len(failures)} of {files.num_files} meshes failed: {listed}")


def _is_needed(record: logging.LogRecord) -> bool:
    """Whether a message of Lightning is one that a user of this command can act on."""
    return not any(text in record.getMessage() for text in ("litlogger", "available: False", "HPU"))
