import numpy as np

from dnf_pyg.mesh.vectors import set_unit, square_distance


def test_square_distance_of_two_rows():
    rows = np.array([[1.0, 2, 3], [0, 0, 0], [2, 0, 5]])
    assert square_distance(rows, 0, 2) == 1 + 4 + 4


def test_rows_become_directions_or_stay():
    out, otherwise = np.zeros((2, 3)), np.array([[1.0, 0, 0], [0, 1, 0]])
    set_unit(out, 0, 0.0, 3.0, -4.0, otherwise)
    set_unit(out, 1, 0.0, 0.0, 0.0, otherwise)
    np.testing.assert_allclose(out, [[0, 0.6, -0.8], [0, 1, 0]], atol=1e-15)
