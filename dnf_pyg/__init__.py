"""Mesh denoising by deep normal filtering (DNF-Net) for PyTorch Geometric."""

import os

__version__ = "0.1.0"

# Threads of torch that wait soon sleep: spinning for long stalls everything where other programs want the cores.
os.environ.setdefault("GOMP_SPINCOUNT", "30000")

from dnf_pyg.errors import DataError, DNFError, MeshError, MeshFileError, MeshFileWarning, OutputError, WeightsError
from dnf_pyg.pipeline import FAST, DenoiseResult, denoise
from dnf_pyg.weights import load_network, packaged_weights

__all__ = [
    "FAST",
    "DNFError",
    "DataError",
    "DenoiseResult",
    "MeshError",
    "MeshFileError",
    "MeshFileWarning",
    "OutputError",
    "WeightsError",
    "__version__",
    "denoise",
    "load_network",
    "packaged_weights",
]
