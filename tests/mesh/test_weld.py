import torch

from dnf_pyg.mesh.weld import weld


def test_mesh_without_copies_is_unchanged(sphere_mesh):
    pos, face = sphere_mesh
    welded = weld(pos, face)
    assert torch.equal(welded.pos, pos)
    assert torch.equal(welded.face, face)
    assert torch.equal(welded.vertex_id, torch.arange(len(pos)))


def test_triangle_soup_becomes_the_mesh_again(sphere_mesh):
    pos, face = sphere_mesh
    soup = pos[face.t().reshape(-1)]
    welded = weld(soup, torch.arange(len(soup)).view(-1, 3).t())
    assert len(welded.pos) == len(pos)
    torch.testing.assert_close(welded.pos[welded.face], pos[face], rtol=0, atol=0)
    assert torch.equal(welded.pos[welded.vertex_id], soup)


def test_nearly_equal_vertices_stay_apart(sphere_mesh):
    pos = torch.tensor([[0.0, 0, 0], [1e-12, 0, 0], [-0.0, 0, 0]], dtype=torch.float64)
    assert weld(pos, torch.tensor([[0], [1], [2]])).vertex_id.tolist() == [0, 1, 0]
