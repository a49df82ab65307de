import numpy as np
import pytest

from dnf_pyg.mesh.vectors import difference_along, set_unit, square_distance, tangent_axes


def test_square_distance_of_two_rows():
    rows = np.array([[1.0, 2, 3], [0, 0, 0], [2, 0, 5]])
    assert square_distance(rows, 0, 2) == 1 + 4 + 4


def test_rows_become_directions_or_stay():
    out, otherwise = np.zeros((2, 3)), np.array([[1.0, 0, 0], [0, 1, 0]])
    set_unit(out, 0, 0.0, 3.0, -4.0, otherwise)
    set_unit(out, 1, 0.0, 0.0, 0.0, otherwise)
    np.testing.assert_allclose(out, [[0, 0.6, -0.8], [0, 1, 0]], atol=1e-15)


def test_axes_are_orthogonal():
    normal = np.random.default_rng(0).normal(size=(20, 3))
    normal[:4] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 1, -1e-9]]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for row in range(len(normal)):
        frame = np.stack([*tangent_axes(normal, row), normal[row]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)


def test_difference_along_an_axis():
    rows = np.array([[1.0, 2, 3], [0, 0, 0], [2, 0, 5]])
    assert difference_along(np.array([0.0, 0.6, 0.8]), rows, 0, 2) == pytest.approx(0.6 * -2 + 0.8 * 2)
