"""From meshes to patches: extraction, seeds, transforms and data sets."""

from dnf_pyg.data.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.data.mesh_dataset import MeshDataset
from dnf_pyg.data.patch import Patch, PatchExtractor, face_surface, patch_to_data
from dnf_pyg.data.seeds import AnisotropicSeeds, SeedSampler, UniformSeeds, cover
from dnf_pyg.data.transforms import JitterNormal, RandomRotation

__all__ = [
    "AnisotropicSeeds",
    "FreshPatchDataset",
    "JitterNormal",
    "MeshDataset",
    "Patch",
    "PatchDataset",
    "PatchExtractor",
    "RandomRotation",
    "SeedSampler",
    "UniformSeeds",
    "cover",
    "face_surface",
    "patch_to_data",
]
