"""Geometry of triangle meshes, as tensors ``pos`` (V, 3) and ``face`` (3, F)."""

from dnf_pyg.mesh.adjacency import boundary_vertices, edge_adjacent, one_ring, vertex_faces
from dnf_pyg.mesh.geodesic import DijkstraGrowth, FacetGraph, Growth, HeatGrowth, nearest_faces
from dnf_pyg.mesh.geometry import (
    edges,
    face_areas,
    face_centroids,
    face_normals,
    filled_face_normals,
    mean_edge_length,
    vertex_normals,
)
from dnf_pyg.mesh.validate import validate_mesh

__all__ = [
    "DijkstraGrowth",
    "FacetGraph",
    "Growth",
    "HeatGrowth",
    "boundary_vertices",
    "edge_adjacent",
    "edges",
    "face_areas",
    "face_centroids",
    "face_normals",
    "filled_face_normals",
    "mean_edge_length",
    "nearest_faces",
    "one_ring",
    "validate_mesh",
    "vertex_faces",
    "vertex_normals",
]
