"""PyG transforms of patches."""

from dnf_pyg.transforms.jitter import JitterNormal
from dnf_pyg.transforms.rotation import RandomRotation

__all__ = ["JitterNormal", "RandomRotation"]
