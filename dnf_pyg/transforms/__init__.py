"""PyG transforms of meshes, facet graphs and patches."""

from dnf_pyg.transforms.facet_graph import ToFacetGraph
from dnf_pyg.transforms.jitter import JitterNormal
from dnf_pyg.transforms.noise import AddNoise
from dnf_pyg.transforms.patches import CutPatches
from dnf_pyg.transforms.rotation import RandomRotation

__all__ = ["AddNoise", "CutPatches", "JitterNormal", "RandomRotation", "ToFacetGraph"]
