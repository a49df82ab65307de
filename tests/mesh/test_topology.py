import numpy as np
import torch

from dnf_pyg.mesh import FacetGraph, Topology, edges, mean_edge_length, one_ring, vertex_faces
from dnf_pyg.mesh import topology as module
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.patches import PatchExtractor


def test_parts_are_those_of_the_functions(cube_mesh):
    pos, face = cube_mesh
    topology = Topology(face, len(pos))
    assert torch.equal(topology.edges, edges(face))
    for own, expected in zip(topology.vertex_faces, vertex_faces(face, len(pos)), strict=True):
        assert torch.equal(own, expected)
    neighbor, centre = one_ring(face, len(pos))
    ptr, ring = topology.one_ring()
    assert np.array_equal(ring, neighbor)
    assert np.array_equal(np.diff(ptr), torch.bincount(centre))
    assert topology.mean_edge_length(pos) == mean_edge_length(pos, face)
    assert topology.mean_edge_length(pos.float()).dtype == torch.float32


def test_no_edges():
    topology = Topology(torch.empty(3, 0, dtype=torch.long), 2)
    assert topology.mean_edge_length(torch.rand(2, 3)) == 0


def test_parts_that_are_kept_are_computed_once_for_all_functions(sphere_mesh, monkeypatch):
    pos, face = sphere_mesh
    expected = update_vertices(pos, face, pos[face].mean(dim=0), 5, early_stopping=True)
    graph = FacetGraph.from_mesh(pos, face)
    calls = []
    for name in ("edges", "vertex_faces", "one_ring_csr"):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *args, name=name, real=real: calls.append(name) or real(*args))
    topology = Topology(face, len(pos))
    for _ in range(2):
        extractor = PatchExtractor(pos, face, topology=topology)
        moved = update_vertices(pos, face, pos[face].mean(dim=0), 5, early_stopping=True, topology=topology)
    assert sorted(calls) == ["edges", "one_ring_csr", "one_ring_csr", "vertex_faces"]
    assert torch.equal(moved, expected)
    assert np.array_equal(extractor.graph.length, graph.length)
    assert np.array_equal(extractor.graph.neighbor, graph.neighbor)


def test_a_given_topology_counts_as_validated(sphere_mesh, monkeypatch):
    pos, face = sphere_mesh
    monkeypatch.setattr("dnf_pyg.mesh.facet_graph.validate_mesh", lambda *_: 1 / 0)
    assert FacetGraph.from_mesh(pos, face, Topology(face, len(pos))).num_faces == face.size(1)
