import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.bands import Bands, band_responses
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_graph import lazy_walk


@pytest.fixture
def sphere():
    ball = trimesh.creation.icosphere(subdivisions=3)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    return np.array(ball.vertices), lazy_walk(Topology(face, len(pos)).edges, len(pos))


def test_equals_powers_of_a_dense_matrix(sphere):
    pos, walk = sphere
    dense, used = walk.toarray(), np.arange(0, len(pos), 2)
    value = np.random.default_rng(1).standard_normal(len(pos))
    normal = pos / np.linalg.norm(pos, axis=1, keepdims=True)
    found = band_responses(walk, value[:, None] * normal, normal, used)
    noise = np.random.default_rng(0).standard_normal((len(pos), 4))
    rest = np.eye(len(pos)) - dense
    for response, differences, means in zip(found, (4, 6, 6, 6), (0, 12, 24, 48), strict=True):
        band = np.linalg.matrix_power(dense, means) @ np.linalg.matrix_power(rest, differences)
        filtered = ((band @ (value[:, None] * normal)) * normal).sum(axis=1)
        expected = np.quantile(np.abs(filtered[used]), 0.25) / np.quantile(np.abs((band @ noise)[used]), 0.25)
        assert response == pytest.approx(expected)


def test_white_noise_responds_alike_in_all_bands(sphere):
    pos, walk = sphere
    flat = np.zeros_like(pos)
    flat[:, 2] = 0.3 * np.random.default_rng(1).standard_normal(len(pos))
    up = np.tile([0.0, 0.0, 1.0], (len(pos), 1))
    assert band_responses(walk, flat, up, np.arange(len(pos))) == pytest.approx([0.3] * 4, rel=0.25)


def test_smooth_fields_respond_in_coarse_bands(sphere):
    pos, walk = sphere
    flat = np.zeros_like(pos)
    flat[:, 2] = pos[:, 0] * pos[:, 1]
    up = np.tile([0.0, 0.0, 1.0], (len(pos), 1))
    high, middle, broad, low = band_responses(walk, flat, up, np.arange(len(pos)))
    assert 5 * high < middle < broad < low


def test_nothing_responds_without_edges():
    points = np.random.default_rng(0).standard_normal((3, 3))
    alone = lazy_walk(torch.zeros(2, 0, dtype=torch.long), 3)
    assert band_responses(alone, points, points, np.arange(3)) == Bands(0, 0, 0, 0)
