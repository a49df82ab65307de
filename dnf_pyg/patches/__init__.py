"""Patches of a mesh: seeds, extraction, coverage."""

from dnf_pyg.patches.options import PatchOptions
from dnf_pyg.patches.patch import FaceFeatures, Patch, PatchExtractor, patch_to_data
from dnf_pyg.patches.seeds import AnisotropicSeeds, cover

__all__ = [
    "AnisotropicSeeds",
    "FaceFeatures",
    "Patch",
    "PatchExtractor",
    "PatchOptions",
    "cover",
    "patch_to_data",
]
