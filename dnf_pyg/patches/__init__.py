"""Patches of a mesh: seeds, extraction, coverage."""

from dnf_pyg.patches.options import PatchOptions
from dnf_pyg.patches.patch import Patch, PatchExtractor, face_surface, patch_to_data
from dnf_pyg.patches.seeds import AnisotropicSeeds, cover

__all__ = [
    "AnisotropicSeeds",
    "Patch",
    "PatchExtractor",
    "PatchOptions",
    "cover",
    "face_surface",
    "patch_to_data",
]
