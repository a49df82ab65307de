import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.detail import Detail
from dnf_pyg.mesh.flatness import pair_deviations


@pytest.fixture
def sphere():
    ball = trimesh.creation.icosphere(subdivisions=2)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    return pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0)), face


def test_differences_equal_powers_of_a_dense_matrix(sphere):
    detail = Detail(*sphere)
    rest = np.eye(len(detail.pos)) - detail.walk.toarray()
    for num_steps in (4, 1, 0, 2):  # in any order
        power = np.linalg.matrix_power(rest, num_steps)
        expected = power @ np.concatenate([detail.pos, detail.white(0)], axis=1)
        np.testing.assert_allclose(detail.differences(num_steps), expected, atol=1e-12)
        along = [np.dot(power[i] @ detail.pos, detail.normal[i]) for i in range(len(detail.pos))]
        np.testing.assert_allclose(detail.along(num_steps), along, atol=1e-12)
        np.testing.assert_allclose(detail.white(num_steps), expected[:, 3:], atol=1e-12)
    assert detail.white(0).std() == pytest.approx(1, abs=0.1)


def test_is_in_mean_edge_lengths(sphere):
    pos, face = sphere
    detail, larger = Detail(pos, face), Detail(7 * pos + 100, face)
    assert larger.unit == pytest.approx(7 * detail.unit)
    np.testing.assert_allclose(larger.pos, detail.pos, atol=1e-12)
    np.testing.assert_allclose(larger.alternation, detail.alternation, atol=1e-9)
    deviation, pair = pair_deviations(pos.numpy(), face.numpy())
    np.testing.assert_allclose(larger.pairs.deviation, deviation / detail.unit, atol=1e-9)
    assert (larger.pairs.pair == pair).all()


def test_vertices_without_a_face_do_not_move_the_centre(sphere):
    pos, face = sphere
    detail = Detail(torch.cat([pos, torch.full((1, 3), 1e9)]), face)
    assert detail.used.tolist() == list(range(len(pos)))
    np.testing.assert_allclose(detail.pos[:-1], Detail(pos, face).pos, atol=1e-12)
    assert np.abs(detail.pos[:-1].mean(axis=0)).max() < 1e-12


@pytest.mark.parametrize(("num_vertices", "num_faces"), [(3, 1), (3, 0), (0, 0)])
def test_meshes_without_extent_are_finite(num_vertices, num_faces):
    face = torch.arange(3)[:, None].expand(3, num_faces)
    detail = Detail(torch.ones(num_vertices, 3), face)
    assert detail.unit == 1
    assert not detail.along(4).any()
    assert np.isfinite(detail.alternation).all()
