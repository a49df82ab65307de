import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.coarse import coarsen


def as_mesh(pos, face):
    return trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)


def test_keeps_a_share_of_the_faces_and_a_sharp_shape(cube_mesh):
    pos, face = cube_mesh
    coarse = coarsen(pos, face)
    assert coarse.face.size(1) == pytest.approx(face.size(1) / 4, abs=4)
    assert as_mesh(coarse.pos, coarse.face).volume == pytest.approx(8, rel=1e-5)
    torch.testing.assert_close(coarse.prolong(coarse.pos), pos, rtol=0, atol=1e-5)


def test_vertices_follow_the_nearest_point_of_the_surface(sphere_mesh):
    pos, face = sphere_mesh
    coarse = coarsen(pos, face)
    expected, *_ = trimesh.proximity.closest_point(as_mesh(coarse.pos, coarse.face), pos.numpy())
    found = coarse.prolong(coarse.pos).numpy()
    assert np.isclose(found, expected, atol=1e-6).all(axis=1).mean() > 0.99
    torch.testing.assert_close(coarse.weight.sum(dim=1), torch.ones(len(pos), dtype=torch.double))
    assert bool((coarse.weight > -1e-12).all())


def test_linear_displacements_are_interpolated_exactly(cube_mesh):
    pos, face = cube_mesh
    coarse = coarsen(pos, face, 0.3)
    linear = torch.randn((3, 3), dtype=torch.double, generator=torch.Generator().manual_seed(0))
    torch.testing.assert_close(coarse.prolong(coarse.pos @ linear), pos @ linear, rtol=0, atol=1e-4)


def test_scales_and_moves_with_the_mesh(sphere_mesh):
    pos, face = sphere_mesh
    first, second = coarsen(pos, face), coarsen(1000 * pos + 5e5, face)
    assert torch.equal(first.face, second.face)
    torch.testing.assert_close(second.pos, 1000 * first.pos + 5e5, rtol=0, atol=1e-2)


def test_sheets_do_not_mix_and_unused_vertices_stay(cube_mesh):
    pos, face = cube_mesh
    both = torch.cat([pos, pos + torch.tensor([0.0, 0.0, 1e-3]), torch.full((1, 3), 9.0)])
    faces = torch.cat([face, face + len(pos)], dim=1)
    coarse = coarsen(both, faces)
    sheets = trimesh.graph.connected_components(as_mesh(coarse.pos, coarse.face).edges_unique)
    (lower,) = (set(sheet.tolist()) for sheet in sheets if int(coarse.corner[0, 0]) in sheet)
    assert len(sheets) == 2
    assert set(coarse.corner[: len(pos)].flatten().tolist()) <= lower
    assert not set(coarse.corner[len(pos) : -1].flatten().tolist()) & lower
    assert coarse.prolong(torch.ones_like(coarse.pos))[-1].tolist() == [0, 0, 0]


@pytest.mark.parametrize("share", [0, 1, -0.5])
def test_share(sphere_mesh, share):
    with pytest.raises(ValueError, match="'share' between 0 and 1"):
        coarsen(*sphere_mesh, share)
