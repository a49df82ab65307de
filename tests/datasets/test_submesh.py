import numpy as np

from dnf_pyg.datasets.submesh import surroundings
from dnf_pyg.mesh import Topology


def test_holds_the_patch_and_every_face_that_touches_it(sphere_mesh):
    pos, face = sphere_mesh
    ptr, ring = Topology(face, len(pos)).one_ring()
    corners, patch = face.t().int().numpy(), np.array([40, 7, 41, 100])
    vertex_id, corner, member = surroundings(corners, ptr, ring, patch, len(pos))
    touched = {v for f in patch for v in corners[f]}
    around = {f for f in range(len(corners)) if touched & set(corners[f])}
    np.testing.assert_array_equal(member[:4], patch)
    assert set(member) == around
    assert len(member) == len(around)
    np.testing.assert_array_equal(vertex_id[corner], corners[member].T)
    assert len(set(vertex_id)) == len(vertex_id) == corner.max() + 1


def test_a_lone_face_comes_alone():
    face = np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)
    ptr, ring = np.zeros(3, dtype=np.int64), np.empty(0, dtype=np.int32)
    vertex_id, corner, member = surroundings(face, ptr, ring, np.array([1]), 6)
    assert vertex_id.tolist() == [3, 4, 5]
    assert corner.ravel().tolist() == [0, 1, 2]
    assert member.tolist() == [1]
