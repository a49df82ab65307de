"""Mesh files: reading, and writing back with other positions."""

from dnf_pyg.io.files import SUFFIXES, MeshFile, find_meshes, read_mesh, write_mesh

__all__ = ["SUFFIXES", "MeshFile", "find_meshes", "read_mesh", "write_mesh"]
