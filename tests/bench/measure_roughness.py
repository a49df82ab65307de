"""Roughness of clean meshes: what a smooth surface through the surroundings of each face misses of its normal.

``python tests/bench/measure_roughness.py FOLDER`` prints, for each mesh of a folder, the mean angle in degrees between
the facet normals and those of quadratic surfaces that fit the clean vertices around each face. The vertices count by
a Gaussian of their distance, with a radius of 1.2 mean edge lengths.
"""

import sys
from pathlib import Path

import torch
from scipy.spatial import cKDTree
from torch.nn import functional as F

from dnf_pyg.evaluate.benchmark.tables import markdown_table
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.geometry import face_centroids, face_normals, mean_edge_length, vertex_normals

RADIUS = 1.2  # mean edge lengths
NUM_VERTICES = 24  # around each face: the weight of farther ones is below 0.1


def fitted_normals(pos, face):
    """Normals (F, 3) of quadratic height fields over the planes of the faces, at their centroids."""
    center, normal, around = face_centroids(pos, face), face_normals(pos, face), vertex_normals(pos, face)
    _, near = cKDTree(pos.numpy()).query(center.numpy(), NUM_VERTICES)
    place = (pos[near] - center[:, None]) / mean_edge_length(pos, face)
    axis = F.normalize(pos[face[1]] - pos[face[0]], dim=1)
    across = torch.linalg.cross(normal, axis, dim=1)
    x, y, height = (torch.einsum("fvc,fc->fv", place, one) for one in (axis, across, normal))
    same_side = torch.einsum("fvc,fc->fv", around[near], normal) > 0
    weight = torch.exp(-place.square().sum(dim=2) / RADIUS**2) * same_side
    terms = torch.stack([torch.ones_like(x), x, y, x * x, x * y, y * y], dim=2)
    product = torch.einsum("fvi,fv,fvj->fij", terms, weight, terms) + 1e-9 * torch.eye(6, dtype=pos.dtype)
    slope = torch.linalg.solve(product, torch.einsum("fvi,fv,fv->fi", terms, weight, height))
    return F.normalize(normal - slope[:, 1:2] * axis - slope[:, 2:3] * across, dim=1)


def main(folder):
    rows = []
    for path in sorted(folder.iterdir()):
        mesh = read_mesh(path)
        roughness = mean_angular_difference(fitted_normals(mesh.pos, mesh.face), face_normals(mesh.pos, mesh.face))
        rows.append([path.stem, f"{mesh.face.size(1):,}", f"{roughness:.2f}"])
    print(markdown_table(["mesh", "faces", "roughness"], rows))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
