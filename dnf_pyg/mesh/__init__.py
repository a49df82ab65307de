"""Geometry of triangle meshes, as tensors ``pos`` (V, 3) and ``face`` (3, F)."""

from dnf_pyg.mesh.adjacency import boundary_vertices, edge_adjacent, one_ring, vertex_faces
from dnf_pyg.mesh.facet_graph import FacetGraph, nearest_faces
from dnf_pyg.mesh.geodesic import DijkstraGrowth, Growth, HeatGrowth
from dnf_pyg.mesh.geometry import (
    edge_lengths,
    edges,
    face_areas,
    face_centroids,
    face_normals,
    filled_face_normals,
    mean_edge_length,
    vertex_normals,
)
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.validate import validate_mesh

__all__ = [
    "DijkstraGrowth",
    "FacetGraph",
    "Growth",
    "HeatGrowth",
    "Topology",
    "boundary_vertices",
    "edge_adjacent",
    "edge_lengths",
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
