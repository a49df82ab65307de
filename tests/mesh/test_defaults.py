"""Functions on meshes do not depend on torch's default dtype and device, or on how a tensor lies in memory."""

import pytest
import torch

from dnf_pyg.mesh import (
    FacetGraph,
    HeatGrowth,
    Topology,
    boundary_vertices,
    edge_adjacent,
    edges,
    face_areas,
    face_centroids,
    face_normals,
    filled_face_normals,
    mean_edge_length,
    nearest_faces,
    one_ring,
    validate_mesh,
    vertex_faces,
    vertex_normals,
)
from dnf_pyg.mesh.flips import flipped_faces, without_flips
from dnf_pyg.mesh.geometry import angular_difference
from dnf_pyg.mesh.normal_smoothing import smooth_normals
from dnf_pyg.mesh.surface_distance import surface_distance
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.mesh.weld import weld
from dnf_pyg.patches import AnisotropicSeeds, PatchExtractor, cover


def results(pos, face):
    """What every function makes of a mesh."""
    validate_mesh(pos, face)
    normal = filled_face_normals(pos, face)
    graph, topology = FacetGraph.from_mesh(pos, face), Topology(face, len(pos))
    extractor = PatchExtractor(pos, face, patch_size=60, k=8)
    generator = torch.Generator().manual_seed(0)
    moved = update_vertices(pos, face, normal.roll(1, dims=0), 5, early_stopping=True)
    return {
        "vertex_faces": torch.cat(vertex_faces(face, len(pos))),
        "one_ring": one_ring(face, len(pos)),
        "edge_adjacent": edge_adjacent(face),
        "boundary_vertices": boundary_vertices(face, len(pos)),
        "edges": edges(face),
        "mean_edge_length": mean_edge_length(pos, face),
        "topology": topology.mean_edge_length(pos),
        "face_normals": face_normals(pos, face),
        "face_areas": face_areas(pos, face),
        "face_centroids": face_centroids(pos, face),
        "vertex_normals": vertex_normals(pos, face),
        "filled_face_normals": normal,
        "angular_difference": angular_difference(normal, normal.roll(1, dims=0)),
        "nearest_faces": nearest_faces(graph, 12),
        "heat": torch.cat(HeatGrowth().bind(pos, face, graph).grow(3, 50)),
        "surface_distance": surface_distance(pos[:9] + 0.1, pos, face),
        "update_vertices": moved,
        "smooth_normals": smooth_normals(normal, pos, topology, 5.0),
        "flipped_faces": flipped_faces(moved, face, -normal),
        "without_flips": without_flips(-moved, pos, face, normal),
        "weld": weld(pos, face).face,
        "seeds": AnisotropicSeeds()(normal, face, 20, generator),
        "patches": torch.cat([patch.face_id for patch in cover(extractor, 2, generator)]),
        "neighbors": extractor.extract(7).neighbor,
    }


def check(actual, expected):
    for name, value in expected.items():
        assert actual[name].dtype == value.dtype, name
        assert torch.equal(actual[name].cpu(), value), name


@pytest.fixture(params=[torch.float32, torch.float64], ids=str)
def mesh(request, sphere_mesh):
    pos, face = sphere_mesh
    pos[5] = pos[4]  # two faces without area
    return pos.to(request.param), face[:, 3:].clone()  # and a boundary


def test_default_dtype(mesh):
    expected = results(*mesh)
    torch.set_default_dtype(torch.float64)
    try:
        check(results(*mesh), expected)
    finally:
        torch.set_default_dtype(torch.float32)


def test_default_device(mesh):
    expected = results(*mesh)
    with torch.device("meta"):  # holds no values: whatever is made on it by mistake fails
        check(results(*mesh), expected)


def test_strides(mesh):
    pos, face = mesh
    expected = results(*mesh)
    strided = pos.new_zeros(3, 2 * len(pos))
    strided[:, ::2] = pos.t()
    check(results(strided.t()[::2], face.t().contiguous().t()), expected)


def test_gradient(mesh):
    check(results(mesh[0].clone().requires_grad_(), mesh[1]), results(*mesh))
