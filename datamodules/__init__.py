"""Data modules for `dnf-pyg fit`, one per source of meshes."""

from datamodules.clean_meshes import CleanMeshesDataModule
from datamodules.cnr import CNRDataModule
from datamodules.generated import GeneratedDataModule

__all__ = ["CNRDataModule", "CleanMeshesDataModule", "GeneratedDataModule"]
