import pytest
import torch
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dnf_pyg.mesh import boundary_vertices, edge_adjacent, one_ring, vertex_faces
from dnf_pyg.mesh.adjacency import opposite_half_edges

FAULTY = {
    "fin": torch.tensor([[0, 0, 0], [1, 1, 1], [2, 3, 4]]),  # three faces at edge 0-1
    "bow tie": torch.tensor([[0, 0], [1, 3], [2, 4]]),  # one common vertex
    "duplicates": torch.tensor([[0, 1, 2], [1, 2, 1], [2, 0, 0]]),  # one face, turned and flipped
    "lone": torch.tensor([[0, 3, 1], [1, 4, 2], [2, 5, 6]]),
    "repeated vertex": torch.tensor([[0, 0, 3], [0, 1, 3], [1, 2, 3]]),
}


def reference(face, common):
    """Ordered pairs (neighbour, centre) of faces with at least ``common`` vertices in common."""
    corner = [set(column.tolist()) for column in face.t()]
    count = range(len(corner))
    pairs = [(g, f) for f in count for g in count if f != g and len(corner[f] & corner[g]) >= common]
    return torch.tensor(pairs, dtype=torch.long).reshape(-1, 2).t()


@pytest.mark.parametrize("face", FAULTY.values(), ids=FAULTY)
def test_pairs_on_faulty_meshes(face):
    assert torch.equal(one_ring(face, num_vertices=7), reference(face, common=1))
    assert torch.equal(edge_adjacent(face), reference(face, common=2))


def test_pairs_match_loop(sphere_mesh):
    pos, face = sphere_mesh
    assert torch.equal(one_ring(face, len(pos)), reference(face, common=1))
    assert torch.equal(edge_adjacent(face), reference(face, common=2))


def test_vertex_faces_match_loop(sphere_mesh):
    pos, face = sphere_mesh
    ptr, face_id = vertex_faces(face, len(pos) + 1)  # one vertex unreferenced
    assert ptr[-1] == ptr[-2] == 3 * face.size(1)
    for v in range(len(pos)):
        assert face_id[ptr[v] : ptr[v + 1]].tolist() == (face == v).any(dim=0).nonzero().flatten().tolist()


def test_face_that_names_a_vertex_twice_is_listed_once():
    ptr, face_id = vertex_faces(torch.tensor([[0, 2], [0, 2], [1, 2]]), num_vertices=3)
    assert (ptr.tolist(), face_id.tolist()) == ([0, 1, 2, 3], [0, 0, 1])


def fan(count, order=None):
    """Faces around vertex 0 of a cone."""
    rim = torch.arange(count) if order is None else order
    return torch.stack([torch.zeros_like(rim), rim + 1, (rim + 1) % count + 1])


def num_components(pairs, num_faces):
    ones = torch.ones(pairs.size(1))
    return connected_components(coo_array((ones, pairs.numpy()), (num_faces, num_faces)), directed=False)[0]


@pytest.mark.parametrize("count", [3, 13, 63, 64])
def test_vertex_keeps_all_its_faces(count):
    face = fan(count)
    pairs = one_ring(face, count + 1)
    assert torch.equal(pairs, reference(face, common=1))
    assert pairs.size(1) == count * (count - 1)


@pytest.mark.parametrize("shuffled", [False, True])
def test_hub_vertex_has_few_pairs_and_stays_connected(shuffled):
    count = 2000
    order = torch.randperm(count, generator=torch.Generator().manual_seed(0)) if shuffled else torch.arange(count)
    pairs = one_ring(fan(count, order), count + 1)
    turn = (order[pairs] - order[0]) % count  # places around the vertex, from the first face of the file
    expected = [(g, f) for f in range(count) for g in range(max(f - 32, 0), min(f + 33, count)) if f != g]
    assert set(map(tuple, turn.t().tolist())) == {*expected, (0, count - 1), (count - 1, 0)}
    code = pairs[1] * count + pairs[0]
    assert torch.equal(code, code.sort().values)
    assert num_components(pairs, count) == 1
    assert edge_adjacent(fan(count, order)).size(1) == 2 * count


def test_hub_with_gaps_fins_and_repeated_vertices_stays_connected():
    kept = torch.tensor([f for f in range(300) if f % 7])
    face = torch.cat([fan(300, kept), fan(300)[:, 5:6], torch.tensor([[0, 0], [0, 0], [0, 9]])], dim=1)
    pairs = one_ring(face, 301)
    found = set(map(tuple, pairs.t().tolist()))
    assert num_components(pairs, face.size(1)) == 1
    assert found >= set(map(tuple, edge_adjacent(face).t().tolist()))
    assert found == {(f, g) for g, f in found}
    assert torch.bincount(pairs[1]).max() <= 70


def test_many_copies_of_a_mesh_have_few_pairs_and_stay_connected(sphere_mesh):
    pos, face = sphere_mesh
    for copies in (face.repeat(1, 50), face.repeat_interleave(50, dim=1)):
        pairs = one_ring(copies, len(pos))
        assert torch.bincount(pairs[1]).max() <= 3 * 64
        assert num_components(pairs, copies.size(1)) == 1


def test_edge_of_very_many_faces_has_few_pairs():
    count = 1500
    face = torch.stack([torch.zeros(count), torch.ones(count), torch.arange(count) + 2]).long()
    pairs = edge_adjacent(face)
    assert torch.bincount(pairs[1]).max() == 2 * 63
    assert num_components(pairs, count) == 1


def test_boundary():
    face = torch.tensor([[0, 0], [1, 2], [2, 3]])  # quad 0123 split along 0-2
    assert boundary_vertices(face, num_vertices=5).tolist() == [True, True, True, True, False]
    closed = torch.tensor([[0, 0, 0, 1], [1, 2, 3, 3], [2, 3, 1, 2]])
    assert not boundary_vertices(closed, num_vertices=4).any()


def test_no_faces():
    face = torch.empty(3, 0, dtype=torch.long)
    assert one_ring(face, 2).shape == edge_adjacent(face).shape == (2, 0)
    assert vertex_faces(face, 2)[0].tolist() == [0, 0, 0]
    assert not boundary_vertices(face, 2).any()


def test_opposite_half_edges_match_a_loop_over_edges(cube_mesh):
    _, face = cube_mesh
    corner = face[:, 1:].numpy()  # with a hole
    around = {}
    for h in range(corner.size):
        row, f = divmod(h, corner.shape[1])
        around.setdefault(frozenset((int(corner[row, f]), int(corner[(row + 1) % 3, f]))), []).append(h)
    expected = sorted(tuple(both) for both in around.values() if len(both) == 2)
    one, two = opposite_half_edges(corner)
    assert sorted(zip(one.tolist(), two.tolist(), strict=True)) == expected
    assert len(expected) == len(around) - 3
