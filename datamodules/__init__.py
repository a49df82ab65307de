"""Data modules for `dnf-pyg fit`, one per source of meshes, and one for `dnf-pyg predict`."""

from datamodules.clean_meshes import CleanMeshesDataModule
from datamodules.cnr import CNRDataModule
from datamodules.depth_camera import DepthCameraDataModule
from datamodules.generated import GeneratedDataModule
from datamodules.joint import JointDataModule, Part
from datamodules.mesh_files import MeshFilesDataModule
from datamodules.pairs import PairsDataModule

__all__ = [
    "CNRDataModule",
    "CleanMeshesDataModule",
    "DepthCameraDataModule",
    "GeneratedDataModule",
    "JointDataModule",
    "MeshFilesDataModule",
    "PairsDataModule",
    "Part",
]
