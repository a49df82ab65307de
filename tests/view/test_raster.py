import numpy as np
import torch

from dnf_pyg.view import Camera, render

FRONT = (0.0, 0.0, 1.0)


def square(depth, half=1.0):
    pos = torch.tensor([[-half, -half, depth], [half, -half, depth], [half, half, depth], [-half, half, depth]])
    return pos, torch.tensor([[0, 0], [1, 2], [2, 3]])


def test_nearer_face_hides_the_farther(sphere_mesh):
    near, face = square(1.0)
    far, _ = square(-1.0)
    pos = torch.cat([near, far])
    red, green = torch.tensor([[1.0, 0, 0]] * 2), torch.tensor([[0.0, 1, 0]] * 2)
    for order in ([0, 1], [1, 0]):
        faces = torch.cat([[face, face + 4][i] for i in order], dim=1)
        color = torch.cat([[red, green][i] for i in order])
        picture = render(pos, faces, Camera.looking_at(pos, FRONT), 16, color)
        assert picture[8, 8, 0] > 0.5
        assert picture[8, 8, 1] == 0


def test_fills_the_frame_without_leaving_it(sphere_mesh):
    pos, face = sphere_mesh
    picture = render(pos, face, Camera.looking_at(pos), 64)
    drawn = picture.min(axis=-1) < 1
    assert not drawn[[0, -1]].any()
    assert not drawn[:, [0, -1]].any()
    assert abs(drawn.mean() - np.pi / 4 / 1.04**2) < 0.02


def test_both_sides_of_a_coloured_face_are_lit():
    pos, face = square(0.0)
    camera, color = Camera.looking_at(pos, FRONT), torch.full((2, 3), 0.5)
    first, second = (render(pos, corners, camera, 8, color) for corners in (face, face.flip(0)))
    np.testing.assert_array_equal(first, second)


def test_faces_without_colour_are_grey_from_the_front_and_blue_from_behind():
    pos, face = square(0.0)
    camera = Camera.looking_at(pos, FRONT)
    red, _, blue = render(pos, face, camera, 8)[4, 4]
    assert red == blue
    red, _, blue = render(pos, face.flip(0), camera, 8)[4, 4]
    assert blue > 1.5 * red
    no_color = torch.full((2, 3), torch.nan)
    np.testing.assert_array_equal(render(pos, face, camera, 8, no_color), render(pos, face, camera, 8))


def test_same_picture_at_any_scale(sphere_mesh):
    pos, face = sphere_mesh
    small, large = 1e-6 * pos, 1e6 * pos
    first = render(small, face, Camera.looking_at(small), 32)
    np.testing.assert_allclose(first, render(large, face, Camera.looking_at(large), 32), atol=1e-5)


def test_zero_area_faces_and_points_are_left_out():
    pos = torch.zeros(3, 3)
    assert (render(pos, torch.tensor([[0], [1], [2]]), Camera.looking_at(pos), 8) == 1).all()
