"""Data modules for `dnf-pyg fit`, one per source of meshes."""

from datamodules.cnr import CNRDataModule

__all__ = ["CNRDataModule"]
