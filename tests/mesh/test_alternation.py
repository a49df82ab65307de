import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.alternation import local_alternation, neighbor_products, noise_share
from dnf_pyg.mesh.coarse import coarsen
from dnf_pyg.mesh.detail import Detail
from dnf_pyg.mesh.noise import CorrelatedNoise, GaussianNormalNoise
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_graph import lazy_walk, smoothed_normals


def alternation(pos, face):
    return Detail(pos, face).alternation


def with_noise(pos, face, level):
    return GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(0))


@pytest.fixture
def sphere():
    ball = trimesh.creation.icosphere(subdivisions=4)
    return torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()


@pytest.fixture
def statue():
    """A sphere with random bumps, decimated to a quarter of its faces: some of the bumps are lost."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t().contiguous()
    coarse = coarsen(CorrelatedNoise([4.0], [1.0])(pos, face, 1.0, torch.Generator().manual_seed(0)), face, 0.25)
    return coarse.pos, coarse.face


def test_equals_the_correlation_by_a_loop(sphere):
    """On a mesh of one piece and one kind of noise, the local means agree with the mean over all edges."""
    pos, face = with_noise(*sphere, 0.2), sphere[1]
    topology = Topology(face, len(pos))
    walk = lazy_walk(topology.edges, len(pos))
    normal = smoothed_normals(walk, pos, face)
    twice = np.linalg.matrix_power(np.eye(len(pos)) - walk.toarray(), 2)

    def correlation(value):
        most = np.median([abs(value[i]) for edge in topology.edges.tolist() for i in edge])
        clipped = [max(-most, min(most, each)) for each in value]
        pairs = [(clipped[i], clipped[j]) for i, j in topology.edges.t().tolist()]
        return sum(one * other for one, other in pairs) / sum((one**2 + other**2) / 2 for one, other in pairs)

    white = twice @ np.random.default_rng(1).standard_normal((len(pos), 20))
    expected = correlation((twice @ pos.numpy() * normal).sum(axis=1)) / np.mean([correlation(w) for w in white.T])
    found = local_alternation(walk, (twice @ pos.numpy() * normal).sum(axis=1), white[:, :4])
    assert found.mean() == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("level", [0.02, 0.1, 0.3])
def test_white_noise_has_one(level, sphere):
    found = alternation(with_noise(*sphere, level), sphere[1])
    assert found.mean() == pytest.approx(1, abs=0.05)
    assert np.quantile(found, 0.05) > 0.8


def test_detail_of_a_decimated_shape_has_less(statue):
    found = [alternation(with_noise(*statue, level), statue[1]).mean() for level in (0.0, 0.05, 0.1, 0.3)]
    assert found == sorted(found)
    assert found[0] < 0.65
    assert found[-1] > 0.9


def test_is_local(statue):
    pos, face = statue
    noisy = torch.where(pos[:, 2:] > 0, with_noise(pos, face, 0.4), pos)
    found = alternation(noisy, face)
    assert found[pos[:, 2] > 0.4].mean() > found[pos[:, 2] < -0.4].mean() + 0.1


def test_does_not_depend_on_scale_position_and_orientation(statue):
    pos, face = statue
    turn = torch.tensor(trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.9]))[:3, :3])
    assert alternation(7 * pos @ turn.t() + 3, face) == pytest.approx(alternation(pos, face), abs=1e-6)


def test_flat_surface_and_no_edges_have_none():
    grid = trimesh.creation.box((1, 1, 1)).subdivide().subdivide()
    found = alternation(torch.tensor(grid.vertices), torch.tensor(grid.faces).t().contiguous())
    assert np.isfinite(found).all()
    empty = alternation(torch.zeros(3, 3, dtype=torch.double), torch.zeros(3, 0, dtype=torch.long))
    assert empty.tolist() == [0, 0, 0]


def test_products_of_neighbours_equal_a_loop():
    edge, values = torch.tensor([[0, 0, 1], [1, 2, 2]]), np.array([[1.0, 2.0], [3.0, -1.0], [5.0, 0.5], [7.0, 7.0]])
    products, squares = np.zeros((4, 2)), np.zeros((4, 2))
    for one, other in edge.t().tolist():
        for end in (one, other):
            products[end] += values[one] * values[other]
            squares[end] += (values[one] ** 2 + values[other] ** 2) / 2
    walk = lazy_walk(edge, len(values))
    for found, expected in zip(neighbor_products(walk, values), (products, squares), strict=True):
        np.testing.assert_allclose(found, expected)


def test_share_of_noise():
    assert noise_share([-1.0, 0.4, 2.0], 1.0).tolist() == [0, 0, 1]
    assert (np.diff(noise_share(np.linspace(0.5, 1, 20), 1.0)) >= 0).all()
    assert noise_share([0.3, 0.7], 0.0).tolist() == [1, 1]
    assert noise_share(0.3, 0.25) == 0.75
