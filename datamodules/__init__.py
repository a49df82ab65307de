"""Data modules for `dnf-pyg fit`, one per source of meshes, and one for `dnf-pyg predict`."""

from dnf_pyg.datamodules.clean_meshes import CleanMeshesDataModule
from dnf_pyg.datamodules.cnr import CNRDataModule
from dnf_pyg.datamodules.depth_camera import DepthCameraDataModule
from dnf_pyg.datamodules.generated import GeneratedDataModule
from dnf_pyg.datamodules.joint import JointDataModule
from dnf_pyg.datamodules.mesh_files import MeshFilesDataModule
from dnf_pyg.datamodules.options import LoaderOptions
from dnf_pyg.datamodules.pairs import PairsDataModule

__all__ = [
    "CNRDataModule",
    "CleanMeshesDataModule",
    "DepthCameraDataModule",
    "GeneratedDataModule",
    "JointDataModule",
    "LoaderOptions",
    "MeshFilesDataModule",
    "PairsDataModule",
]
