"""How meshes are denoised, as options of the command line: what ``denoise`` and ``predict`` share."""

import argparse
import inspect
from typing import Any

import torch

from dnf_pyg.denoise import FAST, denoise
from dnf_pyg.mesh.geodesic import DijkstraGrowth, Growth, HeatGrowth
from dnf_pyg.pretrained import DEFAULT_WEIGHTS, packaged_weights

__all__ = ["add_settings", "count", "denoise_settings", "not_negative"]

_PRECISIONS = {"fp32": torch.float32, "bf16": torch.bfloat16}
_GROWTHS: dict[str, type[Growth]] = {"dijkstra": DijkstraGrowth, "heat": HeatGrowth}
_DEFAULTS = {name: parameter.default for name, parameter in inspect.signature(denoise).parameters.items()}


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Declare the options; those not given are left to :func:`~dnf_pyg.denoise`."""
    known = ", ".join(packaged_weights()) or "none in this build"
    parser.add_argument(
        "--weights",
        default=DEFAULT_WEIGHTS,
        metavar="CHECKPOINT_OR_NAME",
        help=f"checkpoint of `dnf-pyg fit`, folder, or packaged name ({known}); default %(default)s",
    )
    group = parser.add_argument_group("result")

    def add(flag: str, name: str, told: str, **options: Any) -> None:
        default = _DEFAULTS[name]
        shown = f" ({default})" if isinstance(default, int | float) and abs(default) < 1e9 else ""
        group.add_argument(flag, dest=name, default=None, help=told + shown, **options)

    add("--strength", "strength", "0 leaves the mesh as it is, 1 is full", type=_share)
    add("--max-move", "max_move", "limit, in mean edge lengths (none)", type=not_negative, metavar="L")
    add("--iterations", "num_iterations", "most iterations of the vertex update", type=count, metavar="N")
    add("--repeat", "repeat", "times that the network filters its own result", type=count, metavar="N")
    group.add_argument("--preserve-boundary", action="store_true", help="leave open boundaries in place")
    add("--seed", "seed", "seed of the choice of patches", type=int)
    group = parser.add_argument_group("running")
    fast = ", ".join(f"{name} {value}" for name, value in FAST.items())
    group.add_argument("--fast", action="store_true", help=f"sooner, a little worse: {fast}")
    add("--patch-size", "patch_size", "faces per patch", type=count, metavar="N")
    add("--coverage", "min_coverage", "patches that every face lies in, at least", type=count, metavar="M")
    add("--batch-size", "batch_size", "patches per call of the network", type=count, metavar="N")
    group.add_argument("--growth", choices=_GROWTHS, help="geodesic distance that patches follow (dijkstra)")
    group.add_argument("--precision", choices=sorted(_PRECISIONS), help="of the network (fp32)")


def denoise_settings(options: argparse.Namespace) -> dict[str, Any]:
    """Arguments of :func:`~dnf_pyg.denoise` that the options ask for; one given goes before that of ``--fast``."""
    names = ["strength", "max_move", "num_iterations", "repeat", "seed", "patch_size", "min_coverage", "batch_size"]
    settings = dict(FAST) if options.fast else {}
    settings |= {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    if options.preserve_boundary:
        settings["preserve_boundary"] = True
    if options.growth is not None:
        settings["growth"] = _GROWTHS[options.growth]()
    if options.precision is not None:
        settings["precision"] = _PRECISIONS[options.precision]
    return settings


def count(text: str) -> int:
    """Whole number of at least 1.

    Example:
        >>> count("3")
        3
    """
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"Expected a number of at least 1 (got {text})")
    return value


def not_negative(text: str) -> float:
    """Number of at least 0.

    Example:
        >>> not_negative("0.2")
        0.2
    """
    value = float(text)
    if not value >= 0:
        raise argparse.ArgumentTypeError(f"Expected a number of at least 0 (got {text})")
    return value


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"Expected a number from 0 to 1 (got {text})")
    return value
