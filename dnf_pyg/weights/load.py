"""Networks from packaged weights, folders, Lightning checkpoints and the Hugging Face hub."""

import pickle
import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import Cascade, FilteringNetwork
from dnf_pyg.nn.config import build_network, check_noise_range
from dnf_pyg.nn.pretrained import download_folder, packaged_weights, read_folder
from dnf_pyg.options import DEFAULT_WEIGHTS

__all__ = ["DEFAULT_WEIGHTS", "copy_weights", "load_cascade", "load_network", "network_tensors", "read_checkpoint"]

_HUB = "hf://"


def load_cascade(weights: str | Path, data_set: str | None = None) -> Cascade:
    """Load networks in evaluation mode: those of a cascade, or a single one. No code in a file is ever run.

    Args:
        weights: Name of packaged weights, a folder with ``config.json`` and ``model.safetensors``
            (:meth:`~dnf_pyg.nn.FilteringNetwork.save_pretrained`), a Lightning checkpoint made by ``dnf-pyg fit``, or
            ``hf://user/name`` for a repository of the Hugging Face hub.
        data_set: Data set of a joint training whose statistics of batch normalization are used; needed for the
            checkpoint of a training that kept those of several.

    Returns:
        The networks, on the CPU.

    Raises:
        WeightsError: If there are no such weights, the file is damaged, holds code or fits no network, or
            ``data_set`` is missing or unknown.

    Example:
        >>> load_cascade("nothing")
        Traceback (most recent call last):
        dnf_pyg.errors.WeightsError: Expected packaged weights (...), a folder, a checkpoint or hf://user/name (got ...
    """
    name, path = str(weights), Path(weights)
    if name.startswith(_HUB):
        path = download_folder(name.removeprefix(_HUB))
    elif name in packaged_weights():
        path = packaged_weights()[name]
    if path.is_file():
        return Cascade.of_networks([_from_checkpoint(path, data_set)])
    if path.is_dir():
        if data_set is not None:
            raise WeightsError(
                f"Expected no 'data_set' with the folder '{path}' (got '{data_set}'). A folder holds the statistics of "
                "one data set; leave the argument out."
            )
        return Cascade.of_networks(read_folder(path))
    raise WeightsError(
        f"Expected packaged weights ({', '.join(packaged_weights()) or 'none in this build'}), a folder, a checkpoint "
        f"or hf://user/name (got '{weights}'). Check the name, or train weights with `dnf-pyg fit`."
    )


def load_network(weights: str | Path, data_set: str | None = None) -> FilteringNetwork:
    """Load a single network, see :func:`load_cascade`.

    Raises:
        WeightsError: As there, or if the weights are those of several networks.
    """
    networks = load_cascade(weights, data_set).networks
    if len(networks) > 1:
        raise WeightsError(
            f"Expected weights of one network (got '{weights}', a cascade of {len(networks)}). Take "
            "`dnf_pyg.nn.Cascade.from_pretrained` and one of its networks."
        )
    return networks[0]


def copy_weights(weights: str | Path, net: FilteringNetwork) -> list[str]:
    """Copy the tensors of trained weights into a network, as a start for its training.

    Args:
        weights: See :func:`load_network`.
        net: Network to change.

    Returns:
        Names of the layers that the weights lack, such as those of further units; they keep their values.

    Raises:
        WeightsError: If a layer that both have differs in shape, or the weights have more layers.
    """
    state, own = load_network(weights).state_dict(), net.state_dict()
    wrong = [name for name in state if name not in own or own[name].shape != state[name].shape]
    if wrong:
        raise WeightsError(
            f"Expected weights of the configured network (got '{weights}', which differs in {wrong[0]}). Change "
            "`model.net`."
        )
    net.load_state_dict(state, strict=False)
    return sorted({name.rpartition(".")[0] for name in own.keys() - state.keys()})


def _from_checkpoint(path: Path, data_set: str | None) -> FilteringNetwork:
    checkpoint = read_checkpoint(path)
    tensors = network_tensors(checkpoint) | _statistics(path, checkpoint, data_set)
    net = build_network(checkpoint["network"], tensors, str(path))
    data = checkpoint.get("datamodule_hyper_parameters")
    if net.noise_range is None and isinstance(data, dict):
        net.noise_range = _noise_range(data.get("noise_level"), str(path), data_set)
    return net


def _noise_range(level: object, origin: str, data_set: str | None) -> tuple[float, float] | None:
    """Noise levels of a training; of a joint one, those of a data set or the range of all, unless one is unknown."""
    if not isinstance(level, dict):
        return check_noise_range(level, origin)
    levels = level.values() if data_set is None else [level.get(data_set)]
    known = [found for value in levels if (found := check_noise_range(value, origin)) is not None]
    if not known or len(known) < len(levels):
        return None
    lowest, highest = zip(*known, strict=True)
    return min(lowest), max(highest)


def network_tensors(checkpoint: dict[str, Any]) -> dict[str, Any]:
    """Select the tensors of the network from a checkpoint that :func:`read_checkpoint` returned."""
    return {
        key.removeprefix("net."): value for key, value in checkpoint["state_dict"].items() if key.startswith("net.")
    }


def read_checkpoint(path: str | Path) -> dict[str, Any]:
    """Read a checkpoint of plain tensors, numbers and texts that `dnf-pyg fit` made. No code in it is ever run.

    Returns:
        The checkpoint, with a ``network``, a ``state_dict`` by name and, after a joint training, ``statistics`` with
        the lists ``names`` and ``tensors``.

    Raises:
        WeightsError: If the file is damaged, holds code, or is another kind of checkpoint.
    """
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
    state, kept = checkpoint["state_dict"], checkpoint.setdefault("statistics", {"names": [], "tensors": []})
    lists = [kept.get("names"), kept.get("tensors")] if isinstance(kept, dict) else []
    if not _texts(state) or not isinstance(state, dict) or not lists or not all(map(_texts, lists)):
        raise WeightsError(
            f"Expected tensors by name and lists of names of statistics (got '{path}' with others). Copy it again."
        )
    return checkpoint


def _texts(values: object) -> bool:
    return isinstance(values, dict | list) and all(isinstance(value, str) for value in values)


def _statistics(path: Path, checkpoint: dict[str, Any], data_set: str | None) -> dict[str, Any]:
    """Statistics of batch normalization that belong to a data set of a joint training, by name of the tensor."""
    state, names, tensors = checkpoint["state_dict"], *(checkpoint["statistics"][key] for key in ("names", "tensors"))
    if data_set is None and not names and "statistics.values_0" not in state:
        return {}
    if data_set not in names:
        expected = f"one of {', '.join(names)}" if names else "left out, since no statistics are kept by name"
        raise WeightsError(f"Expected 'data_set' to be {expected} (got {data_set!r} for '{path}'). Change data_set.")
    values = [state.get(f"statistics.values_{row}") for row in range(len(tensors))]
    if not all(isinstance(value, Tensor) and value.shape[:1] == (len(names),) for value in values):
        raise WeightsError(f"Expected statistics of {', '.join(names)} (got '{path}' without some). Copy it again.")
    return {key: value[names.index(data_set)] for key, value in zip(tensors, values, strict=True)}
