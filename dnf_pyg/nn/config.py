"""Networks from plain descriptions and tensors that are checked before anything is built."""

import inspect
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from dnf_pyg.errors import WeightsError

if TYPE_CHECKING:
    from dnf_pyg.nn.network import FilteringNetwork

__all__ = [
    "NETWORKS",
    "build_network",
    "build_networks",
    "check_noise_range",
    "check_same_network",
    "describe_network",
    "describe_networks",
]

_VERSION = 2
"""Version of the description; version 1 described a single class by flags and has no entry ``version``."""

NETWORKS: dict[str, type["FilteringNetwork"]] = {}
"""Classes of networks by name; every subclass of :class:`~dnf_pyg.nn.network.FilteringNetwork` is entered."""

_ENTRIES = ("version", "network", "arguments", "noise_range", "random_rotation")
_LARGEST = 2**12  # of any number in a description
_LONGEST = 16  # list of numbers or networks
_FLAGS = {"align": False, "surface": False, "bilateral_iterations": 0}  # of version 1
_DEFAULTS = {"k": [10, 30, 50], "residual_k": 20, "channels": [64, 128, 256]}  # of version 1, where others now


def describe_network(net: "FilteringNetwork") -> dict[str, Any]:
    """Describe a network by its class, constructor arguments and two facts of its training, as plain values."""
    return {
        "version": _VERSION,
        "network": type(net).__name__,
        "arguments": net.arguments,
        "noise_range": None if net.noise_range is None else list(net.noise_range),
        "random_rotation": net.random_rotation,
    }


def build_network(description: object, state: object, origin: str) -> "FilteringNetwork":
    """Build a network in evaluation mode from its description and its tensors.

    Args:
        description: What :func:`describe_network` returned, or the arguments of a network of version 1.
        state: Tensors by name.
        origin: Name of the file, for error messages.

    Raises:
        WeightsError: If the description has unknown entries or values out of range, or the tensors do not fit it or
            hold values that are not finite.
    """
    state = _mapping(state, "tensors by name", origin)
    description = _mapping(description, "a description of a network", origin)
    name, arguments = _read(description, origin)
    noise_range = check_noise_range(description.get("noise_range"), origin)
    random_rotation = description.get("random_rotation", False)
    if not isinstance(random_rotation, bool):
        raise _error("'random_rotation' as true or false", repr(random_rotation)[:80], origin)
    if arguments.get("num_units", 0) > len(state):
        raise _error("'num_units' of at most the number of tensors", f"{arguments['num_units']}", origin)
    try:
        with torch.device("meta"):  # sizes are compared before memory is taken
            net = NETWORKS[name](**arguments)
    except ValueError as error:
        raise _error(f"arguments of a {name}", f"{arguments}: {error}", origin) from error
    expected = net.state_dict()
    for key in sorted(expected.keys() | state.keys()):
        have, want = state.get(key), expected.get(key)
        if not isinstance(have, Tensor) or want is None or have.shape != want.shape:
            shapes = [list(value.shape) if isinstance(value, Tensor) else "none" for value in (want, have)]
            raise _error(f"tensor '{key}' of shape {shapes[0]}", shapes[1], origin)
        dense = have.layout is torch.strided and have.device.type == "cpu" and not have.is_quantized
        if not dense or have.is_floating_point() != want.is_floating_point() or have.is_complex():
            raise _error(f"tensor '{key}' of type {want.dtype}", f"{have.dtype}, {have.layout}, {have.device}", origin)
        if have.is_floating_point() and not bool(have.isfinite().all()):
            raise _error(f"finite values in tensor '{key}'", "NaN or infinity", origin)
    net.load_state_dict({key: _at_least_float32(value.detach()) for key, value in state.items()}, assign=True)
    net.noise_range, net.random_rotation = noise_range, random_rotation
    return net.eval()


def describe_networks(networks: Sequence["FilteringNetwork"]) -> dict[str, Any]:
    """Describe the networks of a cascade; a single one as :func:`describe_network` does."""
    first, *later = map(describe_network, networks)
    return {"version": _VERSION, "cascade": [first, *later]} if later else first


def build_networks(description: object, state: object, origin: str) -> list["FilteringNetwork"]:
    """Build what :func:`describe_networks` described, see :func:`build_network`.

    The tensors of each network of a cascade are called ``stages.<row>.<name>``.
    """
    description, state = _mapping(description, "a description of networks", origin), _mapping(state, "tensors", origin)
    if "cascade" not in description:
        return [build_network(description, state, origin)]
    listed = description["cascade"]
    if set(description) != {"version", "cascade"} or description["version"] != _VERSION:
        raise _error(f"'version' {_VERSION} and 'cascade' only", ", ".join(sorted(description)), origin)
    if not isinstance(listed, list) or not 1 <= len(listed) <= _LONGEST:
        raise _error(f"'cascade' as a list of 1 to {_LONGEST} networks", repr(listed)[:80], origin)
    prefixes = [f"stages.{row}." for row in range(len(listed))]
    stray = [key for key in state if not key.startswith(tuple(prefixes))]
    if stray:
        raise _error("tensors of the networks of the cascade", f"'{stray[0]}'", origin)
    return [
        build_network(part, {key.removeprefix(start): state[key] for key in state if key.startswith(start)}, origin)
        for part, start in zip(listed, prefixes, strict=True)
    ]


def _read(description: Mapping[str, Any], origin: str) -> tuple[str, dict[str, Any]]:
    """Class and checked arguments of a description of either version."""
    name, arguments = _parse(description, origin)
    return name, _checked(NETWORKS[name], arguments, origin)


def check_same_network(description: object, net: "FilteringNetwork", origin: str) -> None:
    """Check that a description is that of a network.

    Raises:
        WeightsError: If it is of another class or has other arguments.
    """
    name, arguments = _read(_mapping(description, "a description of a network", origin), origin)
    own = {"network": type(net).__name__, **net.arguments}
    defaults = {key: entry.default for key, entry in inspect.signature(NETWORKS[name]).parameters.items()}
    stored = {"network": name, **defaults, **arguments}  # older descriptions lack the arguments that were added since
    differing = [key for key in own if stored.get(key) != own[key]]
    if differing:
        listed = ", ".join(f"{key}: {stored.get(key)} in the file, {own[key]} here" for key in differing)
        raise WeightsError(f"Expected a checkpoint of the configured network (got {listed}). Change `model.net`.")


def _parse(description: Mapping[str, Any], origin: str) -> tuple[str, Mapping[str, Any]]:
    """Class and unchecked arguments."""
    if "version" not in description:
        flags = {flag: description.get(flag, default) for flag, default in _FLAGS.items()}
        for flag, default in _FLAGS.items():
            if type(flags[flag]) is not type(default):
                raise _error(f"'{flag}' of type {type(default).__name__}", repr(flags[flag])[:80], origin)
        arguments = {key: value for key, value in description.items() if key not in _FLAGS}
        if not any(flags.values()):
            return "DNFNet", arguments
        if not flags["align"] or not flags["surface"] or arguments.pop("subtract", True) is not True:
            raise _error("'align', 'surface' and 'subtract' to be true", flags, origin)
        return "SurfaceDNFNet", _DEFAULTS | arguments | {"bilateral_iterations": flags["bilateral_iterations"]}
    if description["version"] != _VERSION:
        raise _error(f"'version' {_VERSION}", repr(description["version"]), origin)
    unknown = sorted(set(description) - set(_ENTRIES))
    if unknown:
        raise _error(f"{', '.join(_ENTRIES)} only", ", ".join(unknown), origin)
    name = description.get("network")
    if not isinstance(name, str) or name not in NETWORKS:
        raise _error(f"'network' to be one of {', '.join(NETWORKS)}", repr(name), origin)
    arguments = _mapping(description.get("arguments"), "'arguments' by name", origin)
    return name, arguments


def check_noise_range(value: object, origin: str) -> tuple[float, float] | None:
    """Check the smallest and the largest noise level of a training; ``None`` if they are not known.

    Raises:
        WeightsError: If ``value`` is not a pair of numbers in this order.
    """
    if value is None:
        return None
    levels = list(value) if isinstance(value, list | tuple) else []
    numbers = len(levels) == 2 and all(type(level) in (int, float) for level in levels)
    if not numbers or not 0 <= levels[0] <= levels[1] < float("inf"):
        raise _error("'noise_range' as [smallest, largest]", repr(value)[:80], origin)
    return float(levels[0]), float(levels[1])


def _checked(network: type, arguments: Mapping[str, Any], origin: str) -> dict[str, Any]:
    """Arguments of a network, each of the type of its default and in range."""
    defaults = {name: parameter.default for name, parameter in inspect.signature(network).parameters.items()}
    for name, value in arguments.items():
        if name not in defaults:
            raise _error(f"arguments of {network.__name__}", f"'{name}'", origin)
        default = defaults[name]
        if isinstance(default, bool):
            sound, kind = isinstance(value, bool), "true or false"
        elif isinstance(default, int):
            lowest = min(default, 1)
            sound, kind = _is_count(value, lowest), f"a whole number from {lowest} to {_LARGEST}"
        else:
            sound = isinstance(value, list) and 1 <= len(value) <= _LONGEST and all(map(_is_count, value))
            kind = f"at most {_LONGEST} whole numbers from 1 to {_LARGEST}"
        if not sound:
            raise _error(f"'{name}' to be {kind}", repr(value)[:80], origin)
    return dict(arguments)


def _at_least_float32(value: Tensor) -> Tensor:
    return value.to(torch.promote_types(value.dtype, torch.float32)) if value.is_floating_point() else value


def _is_count(value: object, lowest: int = 1) -> bool:
    return type(value) is int and lowest <= value <= _LARGEST


def _mapping(value: object, kind: str, origin: str) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise _error(kind, repr(value)[:80], origin)
    return dict(value)


def _error(expected: str, got: object, origin: str) -> WeightsError:
    return WeightsError(
        f"Expected {expected} (got {got} in '{origin}'). Copy the weights again, or train them with this package."
    )
