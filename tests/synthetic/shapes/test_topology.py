import numpy as np
import pytest
import trimesh

from dnf_pyg.synthetic.shapes.incidence import corner_angle
from dnf_pyg.synthetic.shapes.topology import collapse_edges, flip_edges, split_edges


@pytest.fixture
def ball():
    """Positions, faces, a label and the outward normal of each face, and 0.3 as the wanted size of every vertex."""
    mesh = trimesh.creation.icosphere(subdivisions=2)
    pos, face = np.array(mesh.vertices), np.array(mesh.faces)
    return pos, face, np.zeros(len(face), np.int64), np.array(mesh.face_normals), np.full(len(pos), 0.3)


def is_a_ball(pos, face):
    mesh = trimesh.Trimesh(pos, face, process=False)
    return mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2 and mesh.volume > 0


def used(pos, face):
    corner, face = np.unique(face, return_inverse=True)
    return pos[corner], face.reshape(-1, 3)


def edge_lengths(pos, face):
    return np.linalg.norm(pos[face] - pos[np.roll(face, -1, axis=1)], axis=2)


def test_splitting_leaves_no_long_edge(ball):
    pos, face, label, _, _ = ball
    size = np.full(len(pos), 0.22)
    pos, face, label, size = split_edges(pos, face, label, size, 1.35)
    assert edge_lengths(pos, face).max() <= 1.35 * 0.22
    assert 320 < len(face) == len(label) < 4 * 320
    assert len(size) == len(pos)
    assert is_a_ball(pos, face)


def test_collapsing_thins_out_and_keeps_the_surface_closed(ball):
    pos, face, label, normal, size = ball
    order = np.random.default_rng(0).permutation(len(face))
    alive = collapse_edges(pos, face, label, normal, 2 * size, order, 0.75)
    assert alive.sum() < 0.7 * len(face)
    assert is_a_ball(*used(pos, face[alive]))


def test_edges_between_surfaces_keep_their_course(ball):
    pos, face, _, normal, size = ball
    label = (pos[face].mean(axis=1)[:, 2] > 0).astype(np.int64)  # two halves: their seam is a feature

    def seam(face, label):
        half = np.sort(np.stack([face, np.roll(face, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        key, row = np.unique(half, axis=0, return_inverse=True)
        owners = [set() for _ in key]
        for edge, owner in zip(row.ravel(), np.repeat(label, 3), strict=True):
            owners[edge].add(int(owner))
        return {tuple(edge) for edge, of in zip(key.tolist(), owners, strict=True) if len(of) == 2}

    before = {vertex for edge in seam(face, label) for vertex in edge}
    alive = collapse_edges(pos, face, label, normal, 2 * size, np.arange(len(face)), 0.75)
    after = {vertex for edge in seam(face[alive], label[alive]) for vertex in edge}
    assert after < before


def test_flipping_ends_with_the_delaunay_criterion(ball):
    pos, face, label, normal, _ = ball
    noise = np.random.default_rng(0).normal(scale=0.06, size=pos.shape)
    pos = (pos + noise) / np.linalg.norm(pos + noise, axis=1, keepdims=True)
    normal = pos[face].mean(axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)

    def sharp(face):
        """Edges whose two opposite angles sum to over 180 degrees."""
        angles = {}
        for triangle in face:
            for i in range(3):
                u, v, a = triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]
                angles[frozenset((u, v))] = angles.get(frozenset((u, v)), 0.0) + corner_angle(pos, u, a, v)
        return sum(angle > np.pi + 1e-6 for angle in angles.values())

    assert sharp(face) > 10
    assert flip_edges(pos, face, label, normal, 50) > 10
    assert sharp(face) == 0
    assert is_a_ball(pos, face)
