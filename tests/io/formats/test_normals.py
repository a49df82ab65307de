import numpy as np
import pytest

from dnf_pyg.io.formats.normals import moved_normals, turned_normals

POS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], dtype=float)
FACE = np.array([[0, 1, 2], [0, 2, 3]])


def loop(normal, corner_normal, face, pos):
    """Sum of the area vectors of the faces that share a place and a stored normal."""
    sums = np.zeros_like(normal)
    for row in range(len(normal)):
        for i, corner in zip(*np.nonzero(corner_normal == row), strict=True):
            for j in range(len(face)):
                for other in range(3):
                    same_place = (POS[face[j, other]] == POS[face[i, corner]]).all()
                    if same_place and (normal[corner_normal[j, other]] == normal[row]).all():
                        a, b, c = pos[face[j]]
                        sums[row] += np.cross(b - a, c - a)
    return sums


@pytest.mark.parametrize("sign", [1, -1])
def test_smooth_and_flat_shading_against_a_loop(sign):
    smooth = sign * np.array([[0.1, 0, 1], [0, 0, 1], [0.2, 0, 1], [0, -0.3, 1]])
    flat = sign * np.array([[0, 0, 1], [-0.4, 0.1, 1]])
    moved = POS + np.array([[0, 0, 0.3], [0, 0.1, 0], [0, 0, -0.2], [0.1, 0, 0]])
    for normal, corner in ((smooth, FACE), (flat, np.array([[0, 0, 0], [1, 1, 1]]))):
        expected = loop(normal, corner, FACE, moved)
        expected *= sign / np.linalg.norm(expected, axis=1, keepdims=True)
        np.testing.assert_allclose(moved_normals(normal, corner, FACE, POS, moved), expected, atol=1e-12)
        np.testing.assert_array_equal(moved_normals(normal, corner, FACE, POS, POS), normal)


def test_normals_without_area_stay():
    normal = np.array([[0.0, 0, 2], [0, 0, 2]])
    after = np.array([[0.0, 0, 0], [3, 0, 0]])
    np.testing.assert_array_equal(turned_normals(normal, np.ones((2, 3)), after), [[0, 0, 2], [1, 0, 0]])
