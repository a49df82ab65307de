import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh import edges, face_normals, mean_edge_length
from dnf_pyg.mesh.early_stopping import EarlyStopping
from dnf_pyg.mesh.vertex_update import update_vertices


def noisy_sphere(subdivisions=4, level=0.2, seed=0):
    """True and noisy positions, with noise along the normals, and faces."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    pos, face = torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()
    noise = torch.randn(len(pos), generator=torch.Generator().manual_seed(seed), dtype=torch.double)
    return pos, pos + level * float(mesh.edges_unique_length.mean()) * noise[:, None] * pos, face


def error(pos, face, true):
    cosine = (face_normals(pos, face) * face_normals(true, face)).sum(dim=1).clamp(-1, 1)
    return float(cosine.arccos().rad2deg().mean())


def waves(pos, height, frequency):
    """A surface with waves that the true one lacks: what wrong normals ask for."""
    return pos * (1 + height * torch.sin(frequency * pos).sum(dim=1, keepdim=True))


def rates_by_matrix(operator, start, direction, ring, num_steps):
    """Median rate of each step in relation to their mean size; the update is a matrix (3 V, 3 V)."""

    def weighted(values, tangential):  # movements along the surface count less
        normal = np.array([(value @ n) * n for value, n in zip(values, direction, strict=True)])
        return normal + tangential * (values - normal)

    signs = np.random.default_rng(0).choice((-1.0, 1.0), len(start))
    noise = signs[:, None] * direction
    size, medians = len(start), []
    pos, left = start, noise
    for count in range(num_steps):
        after, left_after = ((operator @ each.ravel()).reshape(size, 3) for each in (pos, left))
        step, noise_step, moved = after - pos, left_after - left, (pos + after) / 2 - start
        if count == 0:
            squares = [
                sum(float(np.square(each[v] - each[w]).sum()) for v in range(size) for w in ring[v])
                for each in (weighted(step, 0), weighted(noise_step, 0))
            ]
        step, noise_step, moved = (weighted(each, 0.6) for each in (step, noise_step, moved))
        rate = [
            sum(
                (moved[v] - moved[w]) @ (step[v] - step[w])
                + squares[0] / squares[1] * (noise[v] - noise[w]) @ (noise_step[v] - noise_step[w])
                for w in ring[v]
            )
            for v in range(size)
        ]
        for _ in range(4):
            rate = [(rate[v] + sum(rate[w] for w in ring[v])) / (1 + len(ring[v])) for v in range(size)]
        medians.append(float(np.median(rate) / np.mean(np.abs(rate))))
        pos, left = after, left_after
    return np.array(medians)


def test_matches_matrices_and_loops():
    true, noisy, face = noisy_sphere(subdivisions=2)
    normal = face_normals(waves(true, 0.02, 4.0), face)
    mesh = trimesh.Trimesh(true.numpy(), face.t().numpy(), process=False)
    around = [np.flatnonzero((mesh.faces == v).any(axis=1)) for v in range(len(true))]
    operator = np.eye(3 * len(true))
    for v, faces in enumerate(around):
        for f in faces:
            projection = np.outer(normal[f], normal[f]) / len(faces)
            operator[3 * v : 3 * v + 3, 3 * v : 3 * v + 3] -= projection
            for corner in mesh.faces[f]:
                operator[3 * v : 3 * v + 3, 3 * corner : 3 * corner + 3] += projection / 3
    direction = np.array([normal[faces].sum(dim=0).numpy() for faces in around])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    medians = rates_by_matrix(operator, noisy.numpy(), direction, mesh.vertex_neighbors, 40)
    best = 3 + int(np.argmin(medians.cumsum()[2:]))  # 3: the fewest iterations
    assert 3 < best < 29
    ended = []
    found = update_vertices(noisy, face, normal, 60, early_stopping=True, guard=False, ended=lambda *w: ended.append(w))
    expected = np.linalg.matrix_power(operator, best) @ noisy.numpy().ravel()
    torch.testing.assert_close(found, torch.from_numpy(expected).reshape(-1, 3), rtol=0, atol=1e-12)
    assert ended == [(best, "the estimated error began to rise")]


@pytest.mark.parametrize(
    ("rates", "best", "num_steps"),
    [
        ([-1.0, -0.5, -0.2, -0.1, 0.1] + 20 * [0.3], 4, 14),
        ([0.1, 0.1, 0.1] + 20 * [0.3], 3, 13),  # the fewest
        ([-1.0, -0.5, -0.2, -0.1] + 5 * [0.04] + 20 * [-0.05], 29, 29),  # the rise is followed by a fall
        ([-1.0, -0.5, -0.2, -0.1] + 9 * [0.1] + [-5.0] + 20 * [1.0], 14, 24),
        ([-1.0, -0.5, -0.2, -0.1] + 10 * [0.1] + [-5.0], 4, 14),  # the fall is too late
        (20 * [0.0], 20, 20),
    ],
)
def test_searches_for_ten_steps(rates, best, num_steps, monkeypatch):
    true, noisy, face = noisy_sphere(subdivisions=1)
    given = iter(rates)
    monkeypatch.setattr(EarlyStopping, "_relative_rate", lambda *_: next(given))
    stopping = EarlyStopping(lambda values: values, true.numpy(), edges(face), np.ones(len(true), dtype=bool))
    ended = [stopping.should_end(noisy.numpy(), noisy.numpy()) for _ in range(num_steps)]
    assert stopping.best == best
    assert ended == (num_steps - 1) * [False] + [num_steps == best + 10]


@pytest.mark.parametrize("height", [0.003, 0.01, 0.02])
@pytest.mark.parametrize("level", [0.1, 0.3])
def test_stops_near_the_smallest_error(height, level):
    """Normals of a wavy sphere are given for a noisy smooth one: the larger the waves, the sooner the best moment."""
    true, noisy, face = noisy_sphere(level=level)
    normal = face_normals(waves(true, height, 9.0), face)
    errors = [error(update_vertices(noisy, face, normal, count), face, true) for count in range(1, 101)]
    found = error(update_vertices(noisy, face, normal, 100, early_stopping=True), face, true)
    assert found < min(errors) * 1.08
    assert found < errors[-1]


@pytest.mark.parametrize("level", [0.1, 0.2])
def test_noise_in_all_directions_at_sharp_edges(level, cube_mesh):
    """Vertices of edges slide along the surface as well; noise along the normals alone would not explain that."""
    true, face = cube_mesh
    noise = torch.randn(true.shape, generator=torch.Generator().manual_seed(0), dtype=torch.double)
    noisy = true + level * float(mean_edge_length(true, face)) * noise
    normal = face_normals(waves(true, 0.001, 5.0), face)
    errors = [error(update_vertices(noisy, face, normal, count), face, true) for count in range(1, 101)]
    found = error(update_vertices(noisy, face, normal, 100, early_stopping=True), face, true)
    assert found < min(errors) * 1.1
    assert found < 0.5 * errors[2]


def test_true_normals_get_all_iterations():
    true, noisy, face = noisy_sphere()
    normal = face_normals(true, face)
    all_of_them = update_vertices(noisy, face, normal, 30)
    assert torch.equal(update_vertices(noisy, face, normal, 30, early_stopping=True), all_of_them)


def test_scale_position_and_orientation_do_not_matter():
    true, noisy, face = noisy_sphere(subdivisions=3)
    normal = face_normals(waves(true, 0.01, 9.0), face)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.double))[0]
    expected = update_vertices(noisy, face, normal, 60, early_stopping=True)
    found = update_vertices(1000 * noisy @ turn + 5, face, normal @ turn, 60, early_stopping=True)
    torch.testing.assert_close(found, 1000 * expected @ turn + 5, rtol=0, atol=1e-8)


def test_nothing_to_move():
    true, noisy, face = noisy_sphere(subdivisions=1)
    normal = face_normals(true, face)
    fixed = torch.ones(len(true), dtype=torch.bool)
    assert torch.equal(update_vertices(noisy, face, normal, 9, early_stopping=True, fixed=fixed), noisy)
    assert torch.equal(update_vertices(noisy, face, torch.zeros_like(normal), 9, early_stopping=True), noisy)
    lone = torch.cat([true, torch.full((2, 3), 9.0, dtype=torch.double)])
    torch.testing.assert_close(update_vertices(lone, face, normal, 9, early_stopping=True), lone)
