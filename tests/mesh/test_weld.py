import pytest
import torch
import trimesh

from dnf_pyg.mesh.weld import weld


def soup_of(pos, face, jitter=0.0):
    """The triangles one by one, with noise on each corner, model units."""
    soup = pos[face.t().reshape(-1)]
    noise = torch.randn(soup.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    return soup + jitter * noise, torch.arange(len(soup)).view(-1, 3).t()


def sheet(num=4):
    """Square of 2 num^2 faces in the plane z = 0, edges of length 1."""
    grid = torch.cartesian_prod(torch.arange(num + 1), torch.arange(num + 1)).double()
    start = (grid[:, 0] * (num + 1) + grid[:, 1]).long()[(grid < num).all(dim=1)]
    corners = torch.tensor([[0, num + 1, num + 2], [0, num + 2, 1]])
    pos = torch.cat([grid, torch.zeros(len(grid), 1)], dim=1)
    return pos, (start[:, None, None] + corners).reshape(-1, 3).t()


def test_mesh_without_copies_is_unchanged(sphere_mesh):
    pos, face = sphere_mesh
    welded = weld(pos, face)
    assert torch.equal(welded.pos, pos)
    assert torch.equal(welded.face, face)
    assert torch.equal(welded.vertex_id, torch.arange(len(pos)))


def test_triangle_soup_becomes_the_mesh_again(sphere_mesh):
    pos, face = sphere_mesh
    soup, corners = soup_of(pos, face)
    welded = weld(soup, corners)
    assert len(welded.pos) == len(pos)
    torch.testing.assert_close(welded.pos[welded.face], pos[face], rtol=0, atol=0)
    assert torch.equal(welded.pos[welded.vertex_id], soup)


@pytest.mark.parametrize(
    ("scale", "offset", "jitter"), [(1, 0, 1e-7), (1e-3, 0, 1e-9), (1, 1000, 3e-5), (1e4, 0, 0.01)]
)
def test_copies_that_differ_in_their_last_digits_become_one(sphere_mesh, scale, offset, jitter):
    pos, face = scale * sphere_mesh[0] + offset, sphere_mesh[1]
    welded = weld(*soup_of(pos, face, jitter))
    assert len(welded.pos) == len(pos)
    torch.testing.assert_close(welded.pos[welded.face], pos[face], rtol=0, atol=6 * jitter)


def test_seam_between_two_halves(sphere_mesh):
    pos, face = sphere_mesh
    upper = (pos[face][..., 2] >= -1e-9).all(dim=0)
    apart = torch.cat([face[:, upper], face[:, ~upper] + len(pos)], dim=1)
    welded = weld(torch.cat([pos, pos + 1e-7]), apart)
    assert len(welded.face.unique()) == len(pos)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-8])
@pytest.mark.parametrize("facing", [False, True])
def test_thin_sheets_stay_apart(gap, facing):
    pos, face = sheet()
    both = torch.cat([pos, pos + torch.tensor([0, 0, gap])])
    faces = torch.cat([face, (face.flip(0) if facing else face) + len(pos)], dim=1)
    assert len(weld(both, faces).pos) == len(both)
    assert len(weld(*soup_of(both, faces)).pos) == len(both)


def test_closed_plate_thinner_than_the_tolerance_stays():
    plate = trimesh.creation.box((1, 1, 1e-7)).subdivide().subdivide()
    pos, face = torch.tensor(plate.vertices), torch.tensor(plate.faces).t()
    assert len(weld(pos, face).pos) == len(pos)


def test_gap_wider_than_the_tolerance_stays():
    pos, face = sheet(1)
    wide = torch.cat([pos, pos + torch.tensor([1.001, 0, 0])])
    assert len(weld(wide, torch.cat([face, face + 4], dim=1)).pos) == 8


def test_short_edges_do_not_collapse():
    pos, face = sheet(1)
    pos = torch.cat([pos, pos[:1] + torch.tensor([[1e-6, 0, 0]])])
    assert len(weld(pos, torch.cat([face, torch.tensor([[0], [4], [1]])], dim=1)).pos) == 5


def test_vertices_of_no_face_and_empty_meshes():
    pos, face = sheet(1)
    far = torch.cat([pos, torch.full((1, 3), 1e9), torch.full((1, 3), 1e9)])
    assert weld(far, face).vertex_id.tolist() == [0, 1, 2, 3, 4, 4]
    assert weld(pos, face[:, :0]).face.shape == (3, 0)
