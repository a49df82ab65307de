"""PyG data sets of training patches."""

from dnf_pyg.datasets.cnr import CNR
from dnf_pyg.datasets.fresh_patch_dataset import FreshPatchDataset
from dnf_pyg.datasets.mesh_dataset import MeshDataset
from dnf_pyg.datasets.patch_dataset import PatchDataset

__all__ = ["CNR", "FreshPatchDataset", "MeshDataset", "PatchDataset"]
