import pytest
import torch
import trimesh

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


def test_matches_loop_over_vertices(sphere_mesh):
    pos, face = sphere_mesh
    normal = trimesh_normals(pos, face)
    noisy = pos + 0.05 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    torch.testing.assert_close(update_vertices(noisy, face, normal, 3), by_loop(noisy, face, normal, 3))


def test_recovers_facet_normals(cube_mesh):
    pos, face = cube_mesh
    normal = trimesh_normals(pos, face)
    noisy = pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    updated = update_vertices(noisy, face, normal, 100)
    cosine = (trimesh_normals(updated, face) * normal).sum(-1).clamp(-1, 1)
    assert cosine.arccos().rad2deg().mean() < 1.0


def test_stops_by_itself(sphere_mesh):
    pos, face = sphere_mesh
    normal = trimesh_normals(pos, face)
    torch.testing.assert_close(update_vertices(pos, face, normal, 10_000), pos)


def test_leaves_vertices_without_faces(sphere_mesh):
    pos, face = sphere_mesh
    lone = torch.cat([pos, pos.new_tensor([[9.0, 9, 9]])])
    updated = update_vertices(lone, face, trimesh_normals(pos, face).roll(1, 0), 2)
    assert updated[-1].tolist() == [9, 9, 9]
    assert not torch.equal(updated, lone)


def test_keeps_dtype(sphere_mesh):
    pos, face = sphere_mesh
    assert update_vertices(pos.float(), face, trimesh_normals(pos, face), 1).dtype == torch.float32


def test_rejects_wrong_arguments(sphere_mesh):
    pos, face = sphere_mesh
    with pytest.raises(ValueError, match=r"'normal' of shape \[320, 3\] \(got \[162, 3\]\)"):
        update_vertices(pos, face, pos)
    with pytest.raises(ValueError, match=r"'num_iterations' of at least 0 \(got -1\)"):
        update_vertices(pos, face, trimesh_normals(pos, face), -1)
