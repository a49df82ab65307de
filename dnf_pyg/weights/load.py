"""Networks from packaged weights, folders, Lightning checkpoints and the Hugging Face hub."""

import pickle
import warnings
from pathlib import Path
from typing import Any

import torch

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.nn.config import build_network
from dnf_pyg.nn.pretrained import download_folder, packaged_weights, read_folder
from dnf_pyg.options import DEFAULT_WEIGHTS

__all__ = ["DEFAULT_WEIGHTS", "load_network"]

_HUB = "hf://"


def load_network(weights: str | Path, data_set: str | None = None) -> FilteringNetwork:
    """Load a network in evaluation mode. No code in a file is ever run.

    Args:
        weights: Name of packaged weights, a folder with ``config.json`` and ``model.safetensors``
            (:meth:`~dnf_pyg.nn.DNFNet.save_pretrained`), a Lightning checkpoint made by ``dnf-pyg fit``, or
            ``hf://user/name`` for a repository of the Hugging Face hub.
        data_set: Data set of a joint training whose statistics of batch normalization are used; needed for the
            checkpoint of a training that kept those of several.

    Returns:
        The network, on the CPU.

    Raises:
        WeightsError: If there are no such weights, the file is damaged, holds code or fits no network, or
            ``data_set`` is missing or unknown.

    Example:
        >>> load_network("nothing")
        Traceback (most recent call last):
        dnf_pyg.errors.WeightsError: Expected packaged weights (...), a folder, a checkpoint or hf://user/name (got ...
    """
    name, path = str(weights), Path(weights)
    if name.startswith(_HUB):
        path = download_folder(name.removeprefix(_HUB))
    elif name in packaged_weights():
        path = packaged_weights()[name]
    if path.is_file():
        return _from_checkpoint(path, data_set)
    if path.is_dir():
        if data_set is not None:
            raise WeightsError(
                f"Expected no 'data_set' with the folder '{path}' (got '{data_set}'). A folder holds the statistics of "
                "one data set; leave the argument out."
            )
        return read_folder(path)
    raise WeightsError(
        f"Expected packaged weights ({', '.join(packaged_weights()) or 'none in this build'}), a folder, a checkpoint "
        f"or hf://user/name (got '{weights}'). Check the name, or train weights with `dnf-pyg fit`."
    )


def _from_checkpoint(path: Path, data_set: str | None) -> FilteringNetwork:
    checkpoint = _read(path)
    state = checkpoint["state_dict"]
    if not isinstance(state, dict):
        raise WeightsError(f"Expected tensors by name (got '{path}' with {type(state).__name__}). Copy it again.")
    tensors = {key.removeprefix("net."): value for key, value in state.items() if str(key).startswith("net.")}
    tensors |= _statistics(path, checkpoint, data_set)
    net = build_network(checkpoint["network"], tensors, str(path))
    if net.noise_range is None:
        data = checkpoint.get("datamodule_hyper_parameters")
        level = data.get("noise_level") if isinstance(data, dict) else None
        if isinstance(level, list | tuple) and len(level) == 2:
            net.noise_range = float(level[0]), float(level[1])
    return net


def _read(path: Path) -> dict[str, Any]:
    """Content of a checkpoint of plain tensors, numbers and texts."""
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Detected pickle protocol")  # refused in a moment
            checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise WeightsError(
            f"Expected a checkpoint of plain tensors and numbers (got '{path}', which is truncated or holds code, "
            "which is not run). Save it again with `dnf-pyg fit`."
        ) from error
    except (
        RuntimeError,
        EOFError,
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        OverflowError,
    ) as error:
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".")
        raise WeightsError(
            f"Expected a readable checkpoint (got '{path}': {reason}). Copy it again, or take an earlier one."
        ) from error
    if not isinstance(checkpoint, dict) or not {"network", "state_dict"} <= checkpoint.keys():
        raise WeightsError(
            f"Expected a checkpoint made by `dnf-pyg fit` (got '{path}' without key 'network'). Give one of those."
        )
    return checkpoint


def _statistics(path: Path, checkpoint: dict[str, Any], data_set: str | None) -> dict[str, Any]:
    """Statistics of batch normalization that belong to a data set of a joint training, by name of the tensor."""
    kept = checkpoint.get("statistics") or {}
    if not isinstance(kept, dict) or not isinstance(kept.get("names", []), list):
        raise WeightsError(f"Expected statistics by data set (got '{path}' with others). Copy it again.")
    names = kept.get("names", [])
    if data_set is None and not names:
        return {}
    if data_set not in names:
        expected = f"one of {', '.join(map(str, names))}" if names else "left out, since the training kept none apart"
        raise WeightsError(f"Expected 'data_set' to be {expected} (got {data_set!r} for '{path}'). Change it.")
    state = checkpoint["state_dict"]
    return {key: state[f"statistics.values_{row}"][names.index(data_set)] for row, key in enumerate(kept["tensors"])}
