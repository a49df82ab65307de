import numpy as np
import pytest
import torch

from dnf_pyg.mesh.flips import flipped_faces, unfold, without_flips
from dnf_pyg.mesh.geometry import angular_difference, face_normals
from dnf_pyg.mesh.vertex_update import update_vertices


def with_noise(pos, amount, seed=0):
    return pos + amount * torch.randn(pos.shape, generator=torch.Generator().manual_seed(seed), dtype=pos.dtype)


@pytest.mark.parametrize("seed", range(5))
def test_guard_lets_no_face_flip(sphere_mesh, seed):
    pos, face = sphere_mesh
    noisy = with_noise(pos, 0.06, seed)
    wrong = torch.nn.functional.normalize(with_noise(face_normals(pos, face), 0.5, seed + 100), dim=-1)
    before = flipped_faces(noisy, face, wrong)
    free = flipped_faces(update_vertices(noisy, face, wrong, 40, guard=False), face, wrong)
    guarded = flipped_faces(update_vertices(noisy, face, wrong, 40), face, wrong)
    assert (free & ~before).any()
    assert not (guarded & ~before).any()
    assert guarded.sum() <= before.sum()


def test_no_face_flips_halfway(sphere_mesh):
    pos, face = sphere_mesh
    found = 0
    for seed in range(20):
        noisy = with_noise(pos, 0.08, seed)
        wrong = torch.nn.functional.normalize(with_noise(face_normals(pos, face), 0.5, seed + 100), dim=-1)
        half = noisy.lerp(update_vertices(noisy, face, wrong, 40), 0.5)
        before = flipped_faces(noisy, face, wrong)
        found += int((flipped_faces(half, face, wrong) & ~before).sum())
        kept = without_flips(half, noisy, face, wrong)
        assert not (flipped_faces(kept, face, wrong) & ~before).any()
        assert bool(((kept == half) | (kept == noisy)).all())
    assert found > 0


def folded_by_loop(pos, face, normal):
    """Faces at more than 84 degrees to their normal, those that are flipped among them."""
    across = [np.cross(*(pos[corner[1:]] - pos[corner[0]])) for corner in face]
    return [f for f in range(len(face)) if across[f] @ normal[f] < 0.1 * np.linalg.norm(across[f])]


def opened_by_loop(pos, face, normal, fixed):
    """One round: vertices of folded faces move to the mean of their neighbours, less its part across the surface."""
    opened = pos.copy()
    for v in {v for f in folded_by_loop(pos, face, normal) for v in face[f]} - set(np.flatnonzero(fixed)):
        around = [f for f in range(len(face)) if v in face[f]]
        step = np.mean([pos[w] - pos[v] for f in around for w in face[f] if w != v], axis=0)
        axis = sum(normal[f] for f in around)
        opened[v] += step - (step @ axis) * axis / (axis @ axis)
    return opened


def test_unfolding_matches_loop_over_vertices(sphere_mesh):
    """Rounds are repeated until no face is folded."""
    pos, face = sphere_mesh
    normal = face_normals(pos, face).numpy()
    noisy = with_noise(pos, 0.1, seed=2).numpy()
    fixed = np.arange(len(pos)) % 7 == 0
    expected, rounds = noisy, 0
    while folded_by_loop(expected, face.t().numpy(), normal):
        assert rounds < 20
        expected, rounds = opened_by_loop(expected, face.t().numpy(), normal, fixed), rounds + 1
    assert rounds > 1
    opened = unfold(noisy, face.t().numpy(), normal, fixed, noisy, np.inf)
    np.testing.assert_allclose(opened, expected, rtol=0, atol=1e-12)
    assert np.array_equal(opened[fixed], noisy[fixed])


def test_face_across_the_surface_does_not_hold_its_vertices_back():
    """The first step would flip it, and be reverted, as all the others after it."""
    grid = torch.stack(torch.meshgrid(torch.arange(5.0), torch.arange(5.0), indexing="ij"), dim=-1).view(-1, 2)
    pos = torch.cat([grid, torch.zeros(25, 1)], dim=1).double()
    corner = torch.tensor([5 * i + j for i in range(4) for j in range(4)])
    face = torch.cat([torch.stack([corner, corner + 5, corner + 6]), torch.stack([corner, corner + 6, corner + 1])], 1)
    up = torch.tensor([[0.0, 0.0, 1.0]]).expand(face.size(1), 3)
    pos[12] = torch.tensor([1.0 + 1e-3, 2.0, 0.9])  # nearly above its neighbour
    steep = (face_normals(pos, face) * up).sum(dim=1)
    assert 0 < float(steep.min()) < 0.01
    updated = update_vertices(pos, face, up, 100)
    assert float(updated[12, 2]) < 0.2
    assert not flipped_faces(updated, face, up).any()


def test_folds_that_do_not_open_stay(sphere_mesh):
    pos, face = sphere_mesh
    inside_out = -face_normals(pos, face).numpy()
    everywhere = np.zeros(len(pos), dtype=bool)
    assert np.array_equal(
        unfold(pos.numpy(), face.t().numpy(), inside_out, everywhere, pos.numpy(), np.inf), pos.numpy()
    )


def test_unfolding_stays_within_the_limit(sphere_mesh):
    """Vertices that would have to move farther stay in place, and no upright face flips for it."""
    pos, face = sphere_mesh
    normal = face_normals(pos, face)
    noisy, everywhere = with_noise(pos, 0.1), np.zeros(len(pos), dtype=bool)
    free = unfold(noisy.numpy(), face.t().numpy(), normal.numpy(), everywhere, noisy.numpy(), np.inf)
    moved = np.linalg.norm(free - noisy.numpy(), axis=1)
    limit = float(np.median(moved[moved > 0]))
    limited = unfold(noisy.numpy(), face.t().numpy(), normal.numpy(), everywhere, noisy.numpy(), limit)
    assert 0 < np.linalg.norm(limited - noisy.numpy(), axis=1).max() <= limit < moved.max()
    before = flipped_faces(noisy, face, normal)
    assert not (flipped_faces(torch.from_numpy(limited), face, normal) & ~before).any()


def test_triangles_of_a_line_do_not_hold_the_others_back(sphere_mesh):
    pos, face = sphere_mesh
    clean = face_normals(pos, face)
    needle = torch.stack([face[0], torch.arange(face.size(1)) + len(pos), face[1]])  # on an edge of each face
    noisy = pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    with_middles = torch.cat([noisy, (noisy[face[0]] + noisy[face[1]]) / 2])
    alone = update_vertices(noisy, face, clean)
    moved = update_vertices(with_middles, torch.cat([face, needle], dim=1), torch.cat([clean, clean]))[: len(pos)]
    before, best, found = (
        float(angular_difference(face_normals(vertices, face), clean).double().mean())
        for vertices in (noisy, alone, moved)
    )
    assert found < 0.5 * before
    assert found < 1.5 * best
