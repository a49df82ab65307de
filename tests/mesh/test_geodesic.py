import numpy as np
import pytest
import torch
import trimesh
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh import DijkstraGrowth, FacetGraph, HeatGrowth, face_centroids, nearest_faces, one_ring


def all_pairs(graph):
    """Brute-force distances (F, F) in steps."""
    size = (graph.num_faces, graph.num_faces)
    return dijkstra(csr_array((graph.length.astype(np.float64), graph.neighbor, graph.ptr), shape=size))


def reference(distance, k):
    """K nearest by (distance, face id), padded with -1."""
    order = np.argsort(distance, axis=1, kind="stable")[:, :k]
    return np.where(np.isfinite(np.take_along_axis(distance, order, axis=1)), order, -1)


def shaken(mesh, seed=0):
    """Move all vertices a little, so that no two distances are the same."""
    pos, face = mesh
    return pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(seed), dtype=pos.dtype), face


def test_graph_holds_the_one_ring_and_centroid_distances(sphere_mesh):
    pos, face = sphere_mesh
    graph = FacetGraph.from_mesh(pos, face)
    neighbor, centre = one_ring(face, len(pos))
    assert graph.neighbor.tolist() == neighbor.tolist()
    assert np.diff(graph.ptr).tolist() == torch.bincount(centre).tolist()
    centroid = face_centroids(pos, face)
    expected = (centroid[neighbor] - centroid[centre]).norm(dim=1)
    torch.testing.assert_close(torch.from_numpy(graph.length * graph.step), expected, atol=graph.step, rtol=0)


@pytest.mark.parametrize("k", [1, 7, 50, 320])
def test_nearest_faces_match_brute_force(sphere_mesh, k):
    graph = FacetGraph.from_mesh(*shaken(sphere_mesh))
    assert np.array_equal(nearest_faces(graph, k).numpy(), reference(all_pairs(graph), k))


def test_ties_fall_by_face_id(cube_mesh):
    graph = FacetGraph.from_mesh(*cube_mesh)  # regular: most distances occur several times
    assert np.array_equal(nearest_faces(graph, 50).numpy(), reference(all_pairs(graph), 50))


def test_small_components_are_padded(sphere_mesh):
    pos, face = sphere_mesh
    two = torch.cat([face[:, :1], face[:, 40:41]], dim=1)
    assert nearest_faces(FacetGraph.from_mesh(pos, two), k=3).tolist() == [[0, -1, -1], [1, -1, -1]]


@pytest.mark.parametrize("scale", [1e-6, 1e6, 1e-80, 1e25])
@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_size_and_place_do_not_matter(sphere_mesh, scale, shift):
    pos, face = shaken(sphere_mesh)
    here, there = FacetGraph.from_mesh(pos, face), FacetGraph.from_mesh((pos + shift) * scale, face)
    assert np.abs(here.length - there.length).max() <= 1
    assert there.step == pytest.approx(here.step * scale)


def test_all_vertices_in_one_point():
    graph = FacetGraph.from_mesh(torch.full((5, 3), 3.0), torch.tensor([[0, 1, 2], [1, 2, 3], [2, 3, 4]]))
    assert nearest_faces(graph, k=2).tolist() == [[0, 1], [1, 0], [2, 0]]


def test_one_very_long_edge_does_not_overflow():
    pos = torch.zeros(400, 3, dtype=torch.double)
    pos[:, 0] = torch.arange(400)
    pos[::2, 1] = 1
    pos[-1, 0] = 1e12
    strip = torch.stack([torch.arange(398), torch.arange(398) + 1, torch.arange(398) + 2])
    nearest = nearest_faces(FacetGraph.from_mesh(pos, strip), k=398)
    assert (nearest.sort(dim=1).values == torch.arange(398)).all()


def test_rejects_k():
    graph = FacetGraph.from_mesh(torch.eye(3), torch.tensor([[0], [1], [2]]))
    with pytest.raises(ValueError, match=r"Expected 'k' of at least 1 \(got 0\)"):
        nearest_faces(graph, k=0)


def test_graph_checks_the_mesh():
    with pytest.raises(MeshError, match="finite"):
        FacetGraph.from_mesh(torch.full((3, 3), float("nan")), torch.tensor([[0], [1], [2]]))


def test_dijkstra_growth_matches_brute_force(sphere_mesh):
    pos, face = shaken(sphere_mesh)
    graph = FacetGraph.from_mesh(pos, face)
    growth = DijkstraGrowth().bind(pos, face, graph)
    distance = all_pairs(graph)
    for seed in (3, 100, 3):
        face_id, found = growth.grow(seed, size=60)
        assert np.array_equal(face_id, reference(distance, 60)[seed])
        np.testing.assert_allclose(found, distance[seed, face_id] * graph.step, rtol=1e-6)


@pytest.mark.parametrize("growth", [DijkstraGrowth(), HeatGrowth()], ids=repr)
def test_growth_form(cube_mesh, growth):
    pos, face = cube_mesh
    bound = growth.bind(pos, face, FacetGraph.from_mesh(pos, face))
    face_id, distance = bound.grow(5, size=200)
    assert face_id.dtype == torch.long
    assert distance.dtype == torch.float32
    assert len(face_id.unique()) == 200
    assert face_id[0] == 5
    assert distance[0] == 0
    assert (distance.diff() >= 0).all()
    assert len(bound.grow(5, size=5000)[0]) == face.size(1)


@pytest.mark.parametrize("growth", [DijkstraGrowth(), HeatGrowth()], ids=repr)
def test_growth_stays_in_its_component(sphere_mesh, growth):
    pos, face = sphere_mesh
    far = torch.cat([pos, pos + 1.5, pos[:3] + 9])  # two spheres, three vertices without a face
    both = torch.cat([face, face + len(pos)], dim=1)
    bound = growth.bind(far, both, FacetGraph.from_mesh(far, both))
    face_id, distance = bound.grow(330, size=400)
    assert set(face_id.tolist()) == set(range(320, 640))
    assert torch.isfinite(distance).all()


def test_heat_distance_is_geodesic_on_a_sphere():
    ball = trimesh.creation.icosphere(subdivisions=4)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    graph = FacetGraph.from_mesh(pos, face)
    face_id, distance = HeatGrowth().bind(pos, face, graph).grow(0, size=2000)
    near = np.einsum("fvi,i->fv", ball.vertices[ball.faces[face_id]], ball.vertices[ball.faces[0]].mean(axis=0))
    angle = np.arccos((near / np.linalg.norm(ball.vertices[ball.faces[0]].mean(axis=0))).clip(-1, 1)).min(axis=1)
    assert np.abs(distance.numpy() - angle).max() < 0.1


def test_heat_and_dijkstra_agree(sphere_mesh):
    ball = trimesh.creation.icosphere(subdivisions=4)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    graph = FacetGraph.from_mesh(pos, face)
    patches = [growth.bind(pos, face, graph).grow(77, size=800)[0] for growth in (DijkstraGrowth(), HeatGrowth())]
    assert np.intersect1d(*patches).size > 0.95 * 800
