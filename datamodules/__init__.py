"""Data modules for `dnf-pyg fit`, one per source of meshes."""

from datamodules.clean_meshes import CleanMeshesDataModule
from datamodules.cnr import CNRDataModule
from datamodules.depth_camera import DepthCameraDataModule
from datamodules.generated import GeneratedDataModule
from datamodules.joint import JointDataModule, Part
from datamodules.pairs import PairsDataModule

__all__ = [
    "CNRDataModule",
    "CleanMeshesDataModule",
    "DepthCameraDataModule",
    "GeneratedDataModule",
    "JointDataModule",
    "PairsDataModule",
    "Part",
]
