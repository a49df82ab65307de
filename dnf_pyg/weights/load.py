"""Networks from files: packaged weights by name, folders of safetensors, Lightning checkpoints."""

import json
import pickle
import warnings
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet

__all__ = ["DEFAULT_WEIGHTS", "TRAINING_FILE", "load_network", "packaged_weights"]

DEFAULT_WEIGHTS = "best"
TRAINING_FILE = "training.json"  # beside released weights: what they were trained on
_FOLDER = Path(__file__).parent


def packaged_weights() -> dict[str, Path]:
    """Name and folder of every set of weights that the package carries.

    Example:
        >>> all((folder / "config.json").is_file() for folder in packaged_weights().values())
        True
    """
    return {folder.parent.name: folder.parent for folder in sorted(_FOLDER.glob("*/model.safetensors"))}


def load_network(weights: str | Path) -> DNFNet:
    """Load a network in evaluation mode. No code in a file is ever run.

    Args:
        weights: Name of packaged weights, a folder with ``config.json`` and ``model.safetensors``
            (:meth:`DNFNet.save_pretrained`), or a Lightning checkpoint made by ``dnf-pyg fit``.

    Returns:
        The network, on the CPU, with ``noise_range`` where the file tells what it was trained on.

    Raises:
        WeightsError: If there are no such weights, or the file is damaged, holds code, or fits no network.

    Example:
        >>> load_network("nothing")
        Traceback (most recent call last):
        dnf_pyg.errors.WeightsError: Expected packaged weights (...), a folder or a checkpoint (got 'nothing')...
    """
    folder = packaged_weights().get(str(weights), Path(weights))
    if folder.is_dir():
        return _from_folder(folder)
    if folder.is_file():
        return _from_checkpoint(folder)
    names = ", ".join(packaged_weights()) or "none in this build"
    raise WeightsError(
        f"Expected packaged weights ({names}), a folder or a checkpoint (got '{weights}'): train one with `dnf-pyg fit`"
    )


def _from_folder(folder: Path) -> DNFNet:
    missing = [name for name in ("config.json", "model.safetensors") if not (folder / name).is_file()]
    if missing:
        raise WeightsError(
            f"Expected a folder of weights (got '{folder}' without {', '.join(missing)}): give one that "
            "`dnf-pyg weights export` or `save_pretrained` wrote"
        )
    try:
        net = DNFNet(**json.loads((folder / "config.json").read_text(encoding="utf-8")))
        net.load_state_dict(load_file(folder / "model.safetensors"))
        if (folder / TRAINING_FILE).is_file():  # not in folders that save_pretrained wrote
            net.noise_range = _noise_range(json.loads((folder / TRAINING_FILE).read_text(encoding="utf-8")))
    except (OSError, TypeError, ValueError, RuntimeError, SafetensorError) as error:
        raise _other_network(folder, error) from error
    return net.eval()


def _from_checkpoint(path: Path) -> DNFNet:
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Detected pickle protocol")  # refused in a moment
            checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise WeightsError(
            f"Expected a checkpoint of plain tensors and numbers (got '{path}': truncated, or a pickle with code, "
            "which is not run): save it again with `dnf-pyg fit`"
        ) from error
    except (RuntimeError, EOFError, OSError, ValueError, KeyError) as error:
        raise WeightsError(
            f"Expected a readable checkpoint (got '{path}': {_reason(error)}): copy it again, or take an earlier one"
        ) from error
    if not isinstance(checkpoint, dict) or not {"network", "state_dict"} <= checkpoint.keys():
        raise WeightsError(
            f"Expected a checkpoint made by `dnf-pyg fit` (got '{path}' without key 'network'): give one of those"
        )
    state = {
        key.removeprefix("net."): value for key, value in checkpoint["state_dict"].items() if key.startswith("net.")
    }
    try:
        net = DNFNet(**checkpoint["network"])
        net.load_state_dict(state)
        net.noise_range = _noise_range(checkpoint.get("datamodule_hyper_parameters", {}))
    except (TypeError, ValueError, RuntimeError) as error:
        raise _other_network(path, error) from error
    return net.eval()


def _noise_range(training: dict[str, Any]) -> tuple[float, float] | None:
    """Noise levels among what is known of the training."""
    if training.get("noise_level") is None:
        return None
    lowest, highest = training["noise_level"]
    return float(lowest), float(highest)


def _other_network(path: Path, error: BaseException) -> WeightsError:
    return WeightsError(
        f"Expected weights of a DNFNet (got '{path}': {_reason(error)}): copy them again, or train them with "
        "this package"
    )


def _reason(error: BaseException) -> str:
    """What torch says, shortened: its first line, or the one below a line that only announces it."""
    lines = [line.strip() for line in str(error).splitlines()] or [type(error).__name__]
    line = lines[1] if lines[0].endswith(":") and len(lines) > 1 else lines[0]
    return line.split(". ")[0].rstrip(".")
