import torch

from dnf_pyg.evaluate.baselines.hinges import hinges


def loop(face):
    """Every two faces with two vertices in common."""
    corners = face.t().tolist()
    found = {}
    for j, other in enumerate(corners):
        for i, one in enumerate(corners[:j]):
            if len(set(one) & set(other)) == 2 == len(set(one) - set(other)) + len(set(other) - set(one)):
                found[i, j] = set(one) & set(other), (set(one) - set(other)).pop(), (set(other) - set(one)).pop()
    return found


def as_dict(face):
    pair, vertex = hinges(face)
    columns = zip(pair.t().tolist(), vertex.t().tolist(), strict=True)
    return {tuple(faces): ({a, b}, c, d) for faces, (a, b, c, d) in columns}


def test_equals_a_loop_over_pairs(sphere_mesh):
    face = sphere_mesh[1]
    assert as_dict(face) == loop(face)
    assert hinges(face)[0].size(1) == 3 * face.size(1) // 2  # closed: every edge once


def test_three_faces_at_an_edge_and_faces_that_are_there_twice():
    face = torch.tensor([[0, 1, 0, 2, 0], [1, 0, 1, 1, 0], [2, 3, 4, 0, 1]])  # 0 again as 3, and one without area
    assert as_dict(face) == loop(face)
    assert {(0, 1), (0, 2), (1, 2)} < set(as_dict(face))
    assert (0, 3) not in as_dict(face)


def test_lone_faces():
    pair, vertex = hinges(torch.arange(6).view(2, 3).t())
    assert pair.shape == (2, 0)
    assert vertex.shape == (4, 0)
