import numpy as np
import pytest
import trimesh

from dnf_pyg.mesh.flatness import pair_deviations


def test_noise_on_a_plane_gives_half_normal_values():
    plane = trimesh.creation.box((10, 10, 1)).subdivide_to_size(0.5)
    top = plane.vertices[:, 2] > 0.49
    face = plane.faces[top[plane.faces].all(axis=1)].T
    pos = plane.vertices + 0.01 * np.random.default_rng(0).standard_normal((len(plane.vertices), 1)) * [0, 0, 1]
    deviation, pair = pair_deviations(pos, face)
    assert np.sqrt(np.square(deviation).mean()) == pytest.approx(0.01, rel=0.05)
    assert deviation.mean() == pytest.approx(0.01 * np.sqrt(2 / np.pi), rel=0.05)
    assert all(len(set(face[:, a]) & set(face[:, b])) == 2 for a, b in pair.T)


def test_pairs_are_those_of_edges_with_two_faces():
    sphere = trimesh.creation.icosphere(subdivisions=1)
    face = np.concatenate([sphere.faces, sphere.faces[:1]]).T  # three edges now have three faces
    _, pair = pair_deviations(sphere.vertices, face)
    expected = {tuple(sorted(p)) for p in sphere.face_adjacency.tolist()}
    expected -= {p for p in expected if 0 in p}
    assert {tuple(sorted(p)) for p in pair.T.tolist()} == expected


def test_deviation_of_a_bent_pair():
    """A unit square bent along its diagonal: the lines of the diagonals are half as far apart as its corner is high."""
    pos = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.2]])
    deviation, pair = pair_deviations(pos, np.array([[0, 0], [1, 2], [2, 3]]))
    assert pair.tolist() == [[0], [1]] or pair.tolist() == [[1], [0]]
    weight = np.sqrt(4 * 0.25)  # the lines are closest in their middles
    assert deviation[0] == pytest.approx(0.1 / weight, rel=0.01)


def test_flat_mesh_and_lone_face():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert pair_deviations(flat, np.array([[0, 0], [1, 2], [2, 3]])).deviation.tolist() == [0.0]
    assert len(pair_deviations(flat, np.array([[0], [1], [2]])).deviation) == 0
