"""Mesh denoising by deep normal filtering (DNF-Net) for PyTorch Geometric."""

__version__ = "0.1.0"

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
