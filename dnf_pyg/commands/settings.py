"""How meshes are denoised, as options of the command line: what ``denoise`` and ``predict`` share."""

import argparse
import inspect
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import torch

from dnf_pyg.mesh.geodesic import DijkstraGrowth, Growth, HeatGrowth
from dnf_pyg.pipeline import FAST, denoise
from dnf_pyg.weights import DEFAULT_WEIGHTS, packaged_weights

__all__ = ["DEFAULTS", "NumberWithin", "add_settings", "count", "denoise_settings", "not_negative"]

Number = TypeVar("Number", int, float)


@dataclass(frozen=True)
class NumberWithin(Generic[Number]):
    """Read a number of an option, or say what it should be.

    Args:
        kind: ``int`` or ``float``.
        lowest: Smallest value allowed.
        highest: Largest value allowed; none if not given.

    Example:
        >>> NumberWithin(int, 1)("3"), NumberWithin(float, 0, 1)
        (3, number from 0 to 1)
    """

    kind: Callable[[str], Number]
    lowest: int
    highest: int | None = None

    def __call__(self, text: str) -> Number:
        """Read a word."""
        with suppress(ValueError):
            value = self.kind(str(text))
            if self.lowest <= value and (self.highest is None or value <= self.highest):
                return value
        raise argparse.ArgumentTypeError(f"Expected a {self} (got {text})")

    def __repr__(self) -> str:
        limits = f"of at least {self.lowest}" if self.highest is None else f"from {self.lowest} to {self.highest}"
        return f"{'whole ' if self.kind is int else ''}number {limits}"


count = NumberWithin(int, 1)
not_negative = NumberWithin(float, 0)
_share = NumberWithin(float, 0, 1)
_correlation = NumberWithin(float, -1, 1)
_seed = NumberWithin(int, 0, 2**63 - 1)
_patch_size = NumberWithin(int, 1, torch.iinfo(torch.int16).max)  # what numbers the faces of a patch

_PRECISIONS = {"fp32": torch.float32, "bf16": torch.bfloat16}
_GROWTHS: dict[str, type[Growth]] = {"dijkstra": DijkstraGrowth, "heat": HeatGrowth}
DEFAULTS = {name: parameter.default for name, parameter in inspect.signature(denoise).parameters.items()}
"""Defaults of the arguments of :func:`~dnf_pyg.denoise`."""


def add_settings(parser: argparse.ArgumentParser) -> tuple[argparse._ArgumentGroup, argparse._ArgumentGroup]:
    """Declare the options; those not given are left to :func:`~dnf_pyg.denoise`.

    Returns:
        Groups that a command may add to: what decides the result, and how it runs.
    """
    known = ", ".join(packaged_weights()) or "none in this build"
    parser.add_argument(
        "--weights",
        default=DEFAULT_WEIGHTS,
        metavar="CHECKPOINT_OR_NAME",
        help=f"checkpoint of `dnf-pyg fit`, folder, or packaged name ({known}); default %(default)s",
    )
    result, running = parser.add_argument_group("result"), parser.add_argument_group("running")

    def add(group: argparse._ArgumentGroup, flag: str, name: str, told: str, **options: Any) -> None:
        default = DEFAULTS[name]
        shown = f" ({default})" if isinstance(default, int | float) and abs(default) < 1e9 else ""
        group.add_argument(flag, dest=name, default=None, help=told + shown, **options)

    add(result, "--strength", "strength", "0 leaves the mesh as it is, 1 is full", type=_share, metavar="S")
    add(result, "--max-move", "max_move", "largest move of a vertex, in mean edge lengths (no limit)",
        type=not_negative, metavar="L")  # fmt: skip
    add(result, "--iterations", "num_iterations", "most iterations of the vertex update", type=count, metavar="N")
    add(result, "--max-correlation", "max_correlation", "the vertex update ends when neighbouring vertices have begun "
        "to move alike; 1 runs all iterations, for noise that is alike at neighbours", type=_correlation,
        metavar="R")  # fmt: skip
    add(result, "--repeat", "repeat", "times that the network filters, each time its own result; 2 suits strong noise",
        type=count, metavar="N")  # fmt: skip
    result.add_argument("--preserve-boundary", action="store_true", help="leave open boundaries in place")
    add(result, "--seed", "seed", "another choice of patches; the same seed gives the same result",
        type=_seed, metavar="N")  # fmt: skip
    fast = ", ".join(f"{name} {value}" for name, value in FAST.items())
    running.add_argument("--fast", action="store_true", help=f"about half of the time, a little worse: {fast}")
    add(running, "--patch-size", "patch_size", "faces per patch", type=_patch_size, metavar="N")
    add(running, "--coverage", "min_coverage", "patches that every face lies in, at least", type=count, metavar="M")
    add(running, "--batch-size", "batch_size", "patches per call of the network", type=count, metavar="N")
    running.add_argument("--growth", choices=_GROWTHS, help="geodesic distance that patches follow (dijkstra)")
    running.add_argument("--precision", choices=sorted(_PRECISIONS), help="bf16: faster on hardware made for it (fp32)")
    return result, running


def denoise_settings(options: argparse.Namespace) -> dict[str, Any]:
    """Arguments of :func:`~dnf_pyg.denoise` that the options ask for; one given goes before that of ``--fast``."""
    names = (
        "strength",
        "max_move",
        "num_iterations",
        "max_correlation",
        "repeat",
        "seed",
        "patch_size",
        "min_coverage",
        "batch_size",
    )
    settings = dict(FAST) if options.fast else {}
    settings |= {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if options.preserve_boundary:
        settings["preserve_boundary"] = True
    if options.growth is not None:
        settings["growth"] = _GROWTHS[options.growth]()
    if options.precision is not None:
        settings["precision"] = _PRECISIONS[options.precision]
    return settings
