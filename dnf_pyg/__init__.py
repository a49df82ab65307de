"""Mesh denoising by deep normal filtering (DNF-Net) for PyTorch Geometric."""

import os

__version__ = "0.1.0"

# Threads of torch that wait must sleep, not spin: spinning is ten times slower where other programs want the cores.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

from dnf_pyg.denoise import DenoiseResult, denoise
from dnf_pyg.errors import DataError, DNFError, MeshError, MeshFileError, WeightsError
from dnf_pyg.pretrained import load_network, packaged_weights

__all__ = [
    "DNFError",
    "DataError",
    "DenoiseResult",
    "MeshError",
    "MeshFileError",
    "WeightsError",
    "__version__",
    "denoise",
    "load_network",
    "packaged_weights",
]
