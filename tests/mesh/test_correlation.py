import pytest
import torch
from scipy.sparse.csgraph import shortest_path

from dnf_pyg.mesh.correlation import correlation_by_ring
from dnf_pyg.mesh.geometry import edges
from dnf_pyg.mesh.vertex_graph import vertex_adjacency


def brute_force(field, face, max_ring):
    """Mean of the products over all pairs of vertices by the length of the shortest path between them."""
    distance = shortest_path(vertex_adjacency(edges(face), len(field)), unweighted=True)
    used = face.unique().tolist()
    value = {i: float(field[i]) - float(field[used].mean()) for i in used}
    variance = sum(x * x for x in value.values()) / len(used)
    found = []
    for ring in range(1, max_ring + 1):
        products = [value[i] * value[j] for i in used for j in used if distance[i, j] == ring]
        found.append(sum(products) / len(products) / variance)
    return found


@pytest.mark.parametrize("mesh", ["sphere_mesh", "cube_mesh"])
def test_agrees_with_all_pairs(mesh, request):
    pos, face = request.getfixturevalue(mesh)
    field = torch.randn(len(pos), generator=torch.Generator().manual_seed(0)) + pos[:, 0]
    assert correlation_by_ring(field, face, 5) == pytest.approx(brute_force(field, face, 5), abs=1e-6)


def test_does_not_depend_on_scale_or_offset(sphere_mesh):
    pos, face = sphere_mesh
    assert correlation_by_ring(5 - 3 * pos[:, 2], face, 3) == pytest.approx(correlation_by_ring(pos[:, 2], face, 3))


def test_vertices_without_a_face_do_not_count(sphere_mesh):
    pos, face = sphere_mesh
    longer = torch.cat([pos[:, 2], torch.full((10,), 1e6, dtype=pos.dtype)])
    assert correlation_by_ring(longer, face, 3) == pytest.approx(correlation_by_ring(pos[:, 2], face, 3))


def test_rings_that_do_not_exist_and_constant_fields_have_no_correlation():
    face = torch.tensor([[0], [1], [2]])
    value = correlation_by_ring(torch.tensor([1.0, 2, 6]), face, 2)
    assert value[0] == pytest.approx(-0.5)
    assert value[1] != value[1]
    assert all(x != x for x in correlation_by_ring(torch.ones(3), face, 2))


def test_rejects_bad_arguments(sphere_mesh):
    pos, face = sphere_mesh
    with pytest.raises(ValueError, match=r"Expected 'max_ring' of at least 1 \(got 0\)"):
        correlation_by_ring(pos[:, 0], face, 0)
    for field in (pos, pos[:-1, 0]):
        with pytest.raises(ValueError, match="Expected 'field' with one value for each vertex"):
            correlation_by_ring(field, face, 1)
