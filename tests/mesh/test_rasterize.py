import numpy as np

from dnf_pyg.mesh.rasterize import nearest_face


def test_matches_barycentric_coordinates_face_by_face():
    rng = np.random.default_rng(0)
    pixel, face, size = rng.uniform(-2, 14, (12, 3)), rng.permutation(12).reshape(4, 3), 12
    expected = np.full((size, size), -1)
    for row in range(size):
        for column in range(size):
            nearest = -np.inf
            for f, (a, b, c) in enumerate(pixel[face]):
                matrix = np.column_stack([b[:2] - a[:2], c[:2] - a[:2]])
                v, w = np.linalg.solve(matrix, [column + 0.5 - a[0], row + 0.5 - a[1]])
                z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
                if min(v, w, 1 - v - w) >= 0 and z > nearest:
                    nearest, expected[row, column] = z, f
    np.testing.assert_array_equal(nearest_face(pixel, face, size), expected)


def test_faces_seen_from_their_edge_do_not_show():
    pixel = np.array([[0.0, 0, 1], [4, 0, 1], [2, 0, 1]])
    assert (nearest_face(pixel, np.array([[0, 1, 2]]), 4) == -1).all()
