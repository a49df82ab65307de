"""Trained weights: loading, releasing, and those that the package carries."""

from dnf_pyg.nn.pretrained import packaged_weights
from dnf_pyg.weights.load import DEFAULT_WEIGHTS, load_network

__all__ = ["DEFAULT_WEIGHTS", "load_network", "packaged_weights"]
