import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.view import Camera, render


def tensors(mesh):
    return torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()


@pytest.fixture
def half_sphere():
    """The half of a unit sphere that looks along the negative z axis, with a knob at the top (y)."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] < 0)], append=True)
    top = half.vertices[:, 1] > 0.9
    half.vertices[top] *= 1.3
    return tensors(half)


def turn(axis, degrees):
    return torch.tensor(trimesh.transformations.rotation_matrix(np.radians(degrees), axis)[:3, :3])


def blue_share(picture):
    drawn = picture.min(axis=-1) < 1
    return ((picture[..., 2] > 1.2 * picture[..., 0]) & drawn).sum() / drawn.sum()


@pytest.mark.parametrize("degrees", [0, 60, 140, 220])
def test_half_sphere_turned_away_is_seen_from_its_front_upright_filling_the_frame(half_sphere, degrees):
    pos, face = half_sphere
    pos = pos @ turn((0, 1, 0), degrees).t() + torch.tensor([5.0, -3.0, 800.0])
    camera = Camera.choose((pos, face))
    picture = render(pos, face, camera, 96)
    assert blue_share(picture) < 0.005
    assert blue_share(render(pos, face, Camera.looking_at(pos, tuple(-camera.rotation[2])), 96)) > 0.9
    rows, columns = (np.flatnonzero((picture.min(axis=-1) < 1).any(axis=axis)) for axis in (1, 0))
    assert max(np.ptp(rows), np.ptp(columns)) > 0.9 * 96
    seen = camera.project(pos)
    assert seen[:, 1].argmax() == pos[:, 1].argmax()
    assert np.ptp(columns[len(columns) // 2 - 1 :]) < 60
    assert np.ptp(np.flatnonzero(picture[rows[2]].min(axis=-1) < 1)) < 40  # the narrow knob is at the upper end


@pytest.mark.parametrize("up", [(0, 1, 0), (0, -1, 0)])
def test_plane_seen_along_the_y_axis_has_x_to_the_right(up):
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 0, -1]], dtype=torch.float64)
    face = torch.tensor([[0], [1], [2]]) if up[1] > 0 else torch.tensor([[0], [2], [1]])
    torch.testing.assert_close(Camera.choose((pos, face)).rotation[0].abs(), torch.eye(3, dtype=torch.float64)[0])
    assert Camera.choose((pos, face)).rotation[2, 1] == up[1]


def test_coordinate_axes_are_kept_by_a_box_along_them_and_by_a_noisy_cube(cube_mesh):
    pos, face = cube_mesh
    generator = torch.Generator().manual_seed(0)
    noisy = pos + 0.02 * torch.randn(pos.shape, generator=generator, dtype=pos.dtype)
    box = pos * torch.tensor([3.0, 2.0, 1.0])
    expected = Camera.looking_at(pos).rotation
    torch.testing.assert_close(Camera.choose((box, face)).rotation, expected)
    torch.testing.assert_close(Camera.choose((noisy, face)).rotation, expected, atol=0.1, rtol=0)


def test_closed_mesh_is_seen_from_between_its_principal_axes(cube_mesh):
    pos, face = cube_mesh
    box = pos * torch.tensor([6.0, 4.0, 1.0])
    rotation = turn((1, 2, 3), 20)
    turned = Camera.choose((box @ rotation.t(), face))
    straight = Camera.choose((box, face))
    torch.testing.assert_close(turned.rotation @ rotation, straight.rotation, atol=0.05, rtol=0)


def test_open_bottom_points_down():
    vase = trimesh.creation.icosphere(subdivisions=3)
    vase.apply_scale((1, 1, 2))
    vase.update_faces(vase.triangles_center[:, 2] > -1.6)
    camera = Camera.choose(tensors(vase))
    assert camera.rotation[1] @ torch.tensor([0.0, 0, 1], dtype=torch.float64) > 0.8


def test_several_meshes_fit_into_one_frame(sphere_mesh):
    pos, face = sphere_mesh
    camera = Camera.choose((pos, face), (pos + torch.tensor([3.0, 0, 0]), face))
    for where in (pos, pos + torch.tensor([3.0, 0, 0])):
        assert camera.project(where)[:, :2].abs().max() < 1


def test_meshes_without_faces_or_area_still_get_a_camera():
    pos = torch.eye(3)
    for face in (torch.empty(3, 0, dtype=torch.long), torch.tensor([[0], [0], [1]])):
        assert Camera.choose((pos, face)).rotation.isfinite().all()


@pytest.mark.parametrize(
    ("view", "right", "up"),
    [
        ("x", (0, 0, -1), (0, 1, 0)),
        ("-x", (0, 0, 1), (0, 1, 0)),
        ("y", (1, 0, 0), (0, 0, -1)),
        ("-y", (1, 0, 0), (0, 0, 1)),
        ("z", (1, 0, 0), (0, 1, 0)),
        ("-z", (-1, 0, 0), (0, 1, 0)),
    ],
)
def test_views_along_the_axes_frame_all_meshes(half_sphere, view, right, up):
    pos, face = half_sphere
    camera = Camera.choose((pos, face), (pos + torch.tensor([0.0, 5, 0]), face), view=view)
    rows = [right, up, np.cross(right, up)]
    torch.testing.assert_close(camera.rotation, torch.tensor(np.array(rows), dtype=torch.float64))
    assert camera.rotation[2, "xyz".index(view[-1])] == (-1 if "-" in view else 1)
    assert 0.9 < camera.project(torch.cat([pos, pos + torch.tensor([0.0, 5, 0])]))[:, :2].abs().max() <= 1


def test_view_that_is_none(half_sphere):
    assert torch.equal(Camera.choose(half_sphere, view="auto").rotation, Camera.choose(half_sphere).rotation)
    with pytest.raises(ValueError, match=r"one of auto, x, -x, y, -y, z, -z \(got 'up'\)"):
        Camera.choose(half_sphere, view="up")
