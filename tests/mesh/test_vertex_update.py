import pytest
import torch
import trimesh

from dnf_pyg.mesh.flips import flipped_faces
from dnf_pyg.mesh.geometry import face_normals, mean_edge_length
from dnf_pyg.mesh.vertex_update import update_vertices


def by_loop(pos, face, normal, num_iterations):
    pos = pos.clone()
    for _ in range(num_iterations):
        centroid = pos[face].mean(dim=0)
        moved = pos.clone()
        for i in range(len(pos)):
            around = [k for k in range(face.size(1)) if i in face[:, k]]
            if around:
                steps = [normal[k] * torch.dot(normal[k], centroid[k] - pos[i]) for k in around]
                moved[i] = pos[i] + sum(steps) / len(around)
        pos = moved
    return pos


def trimesh_normals(pos, face):
    mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
    return torch.tensor(mesh.face_normals.copy())


def with_noise(pos, amount, seed=0):
    return pos + amount * torch.randn(pos.shape, generator=torch.Generator().manual_seed(seed), dtype=pos.dtype)


def test_matches_loop_over_vertices(sphere_mesh):
    pos, face = sphere_mesh
    normal = trimesh_normals(pos, face)
    noisy = with_noise(pos, 0.05)
    updated = update_vertices(noisy, face, normal, 3, guard=False)
    torch.testing.assert_close(updated, by_loop(noisy, face, normal, 3), rtol=0, atol=1e-12)


def test_recovers_facet_normals(cube_mesh):
    pos, face = cube_mesh
    normal = trimesh_normals(pos, face)
    updated = update_vertices(with_noise(pos, 0.02), face, normal, 100)
    cosine = (trimesh_normals(updated, face) * normal).sum(-1).clamp(-1, 1)
    assert cosine.arccos().rad2deg().mean() < 1.0


def test_stops_by_itself(cube_mesh):
    pos, face = cube_mesh
    normal = trimesh_normals(pos, face)
    torch.testing.assert_close(update_vertices(pos, face, normal, 10_000), pos)
    noisy = with_noise(pos, 0.02)
    long = update_vertices(noisy, face, normal, 100_000)
    assert torch.equal(long, update_vertices(noisy, face, normal, 200_000))


def test_says_why_it_ended(sphere_mesh):
    pos, face = sphere_mesh
    bent = trimesh_normals(pos * (1 + 0.05 * (3 * pos[:, :1]).sin()), face)
    noisy, told = with_noise(pos, 0.05), []
    ended = update_vertices(noisy, face, bent, 60, early_stopping=True, ended=lambda *why: told.append(why))
    count, why = told[0]
    assert 3 <= count < 60
    assert why == "the estimated error began to rise"
    torch.testing.assert_close(ended, update_vertices(noisy, face, bent, count), rtol=0, atol=0)
    update_vertices(noisy, face, bent, 4, ended=lambda *why: told.append(why))
    assert told[1:] == [(4, "the largest number was reached")]
    still = trimesh_normals(pos, face)
    update_vertices(pos, face, still, 9, tolerance=1.0, ended=lambda *why: told.append(why))
    assert told[2:] == [(1, "the vertices came to rest")]


def test_leaves_vertices_without_faces_and_fixed_ones(sphere_mesh):
    pos, face = sphere_mesh
    lone = torch.cat([pos, pos.new_tensor([[9.0, 9, 9]])])
    fixed = torch.zeros(len(lone), dtype=torch.bool)
    fixed[5:9] = True
    updated = update_vertices(lone, face, trimesh_normals(pos, face).roll(1, 0), 2, fixed=fixed)
    stays = (updated == lone).all(dim=1)
    assert stays.nonzero().flatten().tolist() == [5, 6, 7, 8, len(pos)]


def test_limits_how_far_a_vertex_moves(sphere_mesh):
    pos, face = sphere_mesh
    noisy = with_noise(pos, 0.05)
    edge = trimesh.Trimesh(noisy.numpy(), face.t().numpy(), process=False).edges_unique_length.mean()
    normal = trimesh_normals(pos, face)
    free = (update_vertices(noisy, face, normal) - noisy).norm(dim=1) / edge
    limited = (update_vertices(noisy, face, normal, max_move=0.1) - noisy).norm(dim=1) / edge
    assert free.max() > 0.2
    assert limited.max() <= 0.1 + 1e-9
    assert (limited > 0.0999).any()
    assert torch.equal(update_vertices(noisy, face, normal, max_move=0.0), noisy)


def test_opens_folds_of_noise_along_the_surface(sphere_mesh):
    pos, face = sphere_mesh
    normal = trimesh_normals(pos, face)
    noisy = with_noise(pos, 0.1)
    assert flipped_faces(noisy, face, normal).sum() > 10
    angles = [
        (trimesh_normals(update_vertices(noisy, face, normal, 60, guard=guard), face) * normal).sum(-1).clamp(-1, 1)
        for guard in (False, True)
    ]
    free, guarded = (cosine.arccos().rad2deg().mean() for cosine in angles)
    assert guarded < 0.5 * free


def test_moves_turns_and_scales_with_the_mesh(sphere_mesh):
    pos, face = sphere_mesh
    noisy, normal = with_noise(pos, 0.05), trimesh_normals(pos, face)
    turn = torch.linalg.qr(with_noise(torch.zeros(3, 3, dtype=pos.dtype), 1.0)).Q
    turn[:, 0] *= torch.linalg.det(turn)
    expected = update_vertices(noisy, face, normal)
    moved = update_vertices(1e-3 * noisy @ turn.t() + 1e3, face, normal @ turn.t())
    torch.testing.assert_close((moved - 1e3) @ turn * 1e3, expected, rtol=0, atol=1e-8)


def test_keeps_dtype(sphere_mesh):
    pos, face = sphere_mesh
    assert update_vertices(pos.float(), face, trimesh_normals(pos, face), 1).dtype == torch.float32


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"num_iterations": -1}, r"'num_iterations' of at least 0 \(got -1\)"),
        ({"max_move": -0.5}, r"'max_move' of at least 0 \(got -0.5\)"),
        ({"fixed": torch.zeros(3, dtype=torch.bool)}, r"'fixed' of shape \[162\] \(got \[3\]\)"),
        ({"normal": torch.zeros(162, 3)}, r"'normal' of shape \[320, 3\] \(got \[162, 3\]\)"),
    ],
)
def test_rejects_wrong_arguments(sphere_mesh, arguments, text):
    pos, face = sphere_mesh
    normal = trimesh_normals(pos, face)
    with pytest.raises(ValueError, match=text):
        update_vertices(**{"pos": pos, "face": face, "normal": normal, **arguments})


def test_weights_slow_the_movement_towards_a_plane(cube_mesh):
    pos, face = cube_mesh
    noisy = pos + 0.1 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    target = face_normals(pos, face).double()
    weight = torch.rand(face.size(1), generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    moved = update_vertices(noisy, face, target, 1, weight=weight, guard=False)
    for vertex in (0, 5, 20):
        around = (face == vertex).any(dim=0).nonzero()[:, 0]
        step = torch.zeros(3, dtype=torch.float64)
        for number in around.tolist():
            centroid = noisy[face[:, number]].double().mean(dim=0)
            distance = target[number].dot(centroid - noisy[vertex].double())
            step += weight[number] * distance * target[number] / len(around)
        torch.testing.assert_close(moved[vertex].double(), noisy[vertex].double() + step, rtol=0, atol=1e-6)
    everywhere = update_vertices(noisy, face, target, 5, weight=torch.ones(face.size(1)))
    assert torch.equal(everywhere, update_vertices(noisy, face, target, 5))
    with pytest.raises(ValueError, match=r"'weight' of shape"):
        update_vertices(noisy, face, target, weight=weight[1:])


def test_each_vertex_has_its_own_limit(cube_mesh):
    pos, face = cube_mesh
    noisy = pos + 0.1 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    limit = torch.where(torch.arange(len(pos)) % 2 == 0, 0.01, float("inf"))
    moved = update_vertices(noisy, face, face_normals(pos, face), max_move=limit)
    unit = mean_edge_length(noisy, face)
    length = (moved - noisy).norm(dim=1) / unit
    assert length[::2].max() < 0.01 + 1e-6
    assert length[1::2].max() > 0.05
    with pytest.raises(ValueError, match="'max_move' of at least 0"):
        update_vertices(noisy, face, face_normals(pos, face), max_move=limit - 1)
