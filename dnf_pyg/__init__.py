"""Mesh denoising by deep normal filtering (DNF-Net) for PyTorch Geometric."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dnf_pyg.errors import (
    DataError,
    DenoiseWarning,
    DNFError,
    MeshError,
    MeshFileError,
    MeshFileWarning,
    OptionError,
    OutputError,
    WeightsError,
)
from dnf_pyg.options import FAST, FilterOptions, UpdateOptions

if TYPE_CHECKING:
    from dnf_pyg.pipeline import DenoiseResult, denoise
    from dnf_pyg.weights import load_network, packaged_weights

__version__ = "0.1.0"

__all__ = [
    "FAST",
    "DNFError",
    "DataError",
    "DenoiseResult",
    "DenoiseWarning",
    "FilterOptions",
    "MeshError",
    "MeshFileError",
    "MeshFileWarning",
    "OptionError",
    "OutputError",
    "UpdateOptions",
    "WeightsError",
    "__version__",
    "denoise",
    "load_network",
    "packaged_weights",
]

_LAZY = {  # imported when first used, since torch takes seconds to import
    "DenoiseResult": "dnf_pyg.pipeline",
    "denoise": "dnf_pyg.pipeline",
    "load_network": "dnf_pyg.weights",
    "packaged_weights": "dnf_pyg.weights",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
