import pytest
import torch

from dnf_pyg.mesh.flips import flipped_faces, without_flips
from dnf_pyg.mesh.geometry import angular_difference, face_normals
from dnf_pyg.mesh.vertex_update import update_vertices


def with_noise(pos, size, seed=0):
    return pos + size * torch.randn(pos.shape, generator=torch.Generator().manual_seed(seed), dtype=pos.dtype)


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
