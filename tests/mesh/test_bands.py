import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.bands import Bands, band_responses
from dnf_pyg.mesh.detail import Detail


@pytest.fixture
def sphere():
    ball = trimesh.creation.icosphere(subdivisions=3)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    return pos, face


def responses(pos, face, values):
    """Bands of vectors (V, 3), measured along z, in place of the positions."""
    detail = Detail(pos, face)
    detail.normal = np.tile([0.0, 0.0, 1.0], (len(pos), 1))
    detail.differences(0)[:, :3] = values
    return band_responses(detail)


def test_equals_powers_of_a_dense_matrix(sphere):
    pos, face = sphere[0], sphere[1][:, :900]  # some vertices have no face
    value = np.random.default_rng(1).standard_normal((len(pos), 3))
    found = responses(pos, face, value)
    dense, used = Detail(pos, face).walk.toarray(), np.unique(face)
    noise = np.random.default_rng(0).standard_normal((len(pos), 4))
    rest = np.eye(len(pos)) - dense
    for response, differences, means in zip(found, (4, 6, 6, 6), (0, 12, 24, 48), strict=True):
        band = np.linalg.matrix_power(dense, means) @ np.linalg.matrix_power(rest, differences)
        filtered = band @ value[:, 2]
        expected = np.quantile(np.abs(filtered[used]), 0.25) / np.quantile(np.abs((band @ noise)[used]), 0.25)
        assert response == pytest.approx(expected)


def test_white_noise_responds_alike_in_all_bands(sphere):
    pos, face = sphere
    height = np.zeros((len(pos), 3))
    height[:, 2] = 0.3 * np.random.default_rng(1).standard_normal(len(pos))
    assert responses(pos, face, height) == pytest.approx([0.3] * 4, rel=0.25)


def test_smooth_fields_respond_in_coarse_bands(sphere):
    pos, face = sphere
    height = np.zeros((len(pos), 3))
    height[:, 2] = pos[:, 0] * pos[:, 1]
    high, middle, broad, low = responses(pos, face, height)
    assert 5 * high < middle < broad < low


def test_nothing_responds_where_all_vertices_coincide():
    assert band_responses(Detail(torch.ones(3, 3), torch.tensor([[0], [1], [2]]))) == Bands(0, 0, 0, 0)
