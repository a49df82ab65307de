import torch
import trimesh

from dnf_pyg.mesh.winding import consistent_faces


def turn(face, rows):
    return torch.where(rows, face[[0, 2, 1]], face)


def a_tenth(face):
    return torch.rand(face.size(1), generator=torch.Generator().manual_seed(0)) < 0.1


def same(found, face):
    """Whether faces have the same vertices in the same direction, whichever comes first."""
    return torch.stack([(found == face.roll(shift, dims=0)).all(dim=0) for shift in range(3)]).any(dim=0)


def test_sound_faces_are_unchanged(sphere_mesh):
    face = sphere_mesh[1]
    found = consistent_faces(face)
    assert torch.equal(found.face, face)
    assert found.face_id.tolist() == list(range(320))
    assert (found.sign == 1).all()
    assert (found.num_turned, found.num_doubled) == (0, 0)


def test_minority_is_turned(sphere_mesh):
    rows = a_tenth(sphere_mesh[1])
    found = consistent_faces(turn(sphere_mesh[1], rows))
    assert same(found.face, sphere_mesh[1]).all()
    assert torch.equal(found.sign == -1, rows)
    assert found.num_turned == rows.sum()


def test_each_part_has_its_own_majority(sphere_mesh):
    face, rows = sphere_mesh[1], a_tenth(sphere_mesh[1])
    both = torch.cat([turn(face, rows), turn(face, ~rows) + 162], dim=1)
    found = consistent_faces(both)
    assert same(found.face[:, :320], face).all()
    assert same(found.face[:, 320:], turn(face, torch.ones(320, dtype=torch.bool)) + 162).all()


def test_faces_of_the_same_vertices_are_one(sphere_mesh):
    face = sphere_mesh[1]
    found = consistent_faces(torch.cat([face, face[[0, 2, 1]], face[[1, 2, 0]]], dim=1))
    assert torch.equal(found.face, face)
    assert found.face_id.tolist() == 3 * list(range(320))
    assert found.sign.tolist() == 320 * [1] + 320 * [-1] + 320 * [1]
    assert (found.num_turned, found.num_doubled) == (0, 640)


def test_moebius_strip_stays():
    one = torch.arange(10)
    low, high = 2 * one, 2 * one + 1
    next_low, next_high = (2 * one + 2) % 20, (2 * one + 3) % 20
    next_low[-1], next_high[-1] = 1, 0  # joined with a twist
    face = torch.cat([torch.stack([low, next_low, next_high]), torch.stack([low, next_high, high])], dim=1)
    found = consistent_faces(face)
    assert torch.equal(found.face, face)
    assert found.num_turned == 0


def test_edges_of_three_faces_and_degenerate_faces_are_passed_over():
    face = torch.tensor([[0, 1, 2], [1, 0, 3], [0, 1, 4], [3, 3, 0], [2, 2, 2]]).t()
    assert torch.equal(consistent_faces(face).face, face)
    assert consistent_faces(face[:, :0]).face.shape == (3, 0)


def test_winding_agrees_with_that_of_trimesh():
    mesh = trimesh.creation.annulus(3, 5, 2)
    face = torch.tensor(mesh.faces).t()
    found = consistent_faces(turn(face, a_tenth(face)))
    assert trimesh.Trimesh(mesh.vertices, found.face.t().numpy(), process=False).is_winding_consistent
