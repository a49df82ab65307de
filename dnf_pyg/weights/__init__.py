"""Trained weights: loading, releasing, and those that the package carries."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dnf_pyg.options import DEFAULT_WEIGHTS

if TYPE_CHECKING:
    from dnf_pyg.nn.pretrained import packaged_weights
    from dnf_pyg.weights.load import load_network

__all__ = ["DEFAULT_WEIGHTS", "load_network", "packaged_weights"]

_LAZY = {"load_network": "dnf_pyg.weights.load", "packaged_weights": "dnf_pyg.nn.pretrained"}  # they import torch


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)
