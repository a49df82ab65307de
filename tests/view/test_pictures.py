import matplotlib.image
import numpy as np
import pytest
import torch
from matplotlib import colormaps
from matplotlib.figure import Figure

from dnf_pyg.view import Camera, draw_faces, draw_meshes, normal_error

POS = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
FACE = torch.tensor([[0, 0], [1, 2], [2, 3]])  # lower right and upper left half of a square
FRONT = Camera.looking_at(POS, (0, 0, 1))


def hue(color):
    """A colour without its brightness, which the light changes."""
    return np.asarray(color[:3]) / np.max(color[:3])


def drawn(value, **options):
    axis = Figure().subplots()
    scale = draw_faces(axis, POS, FACE, value, camera=FRONT, size=40, **options)
    picture = axis.images[0].get_array()
    return scale, picture[30, 30], picture[10, 10]  # a pixel of each face


@pytest.fixture
def meshes(sphere_mesh):
    pos, face = sphere_mesh
    noise = torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    return {"clean": (pos, face), "noisy": (pos + 0.05 * noise, face)}


def test_normal_error_in_degrees(sphere_mesh):
    pos, face = sphere_mesh
    angle = torch.tensor(0.2)
    turn = torch.tensor([[angle.cos(), -angle.sin(), 0], [angle.sin(), angle.cos(), 0], [0, 0, 1]], dtype=pos.dtype)
    error = normal_error(pos @ turn.t(), pos, face)
    assert abs(float(error.max()) - 0.2 * 180 / torch.pi) < 0.1
    assert float(normal_error(pos, pos, face).max()) < 1e-5


def test_picture_shows_meshes_and_error_maps(tmp_path, meshes):
    draw_meshes(tmp_path / "plain.png", meshes, size=100)
    draw_meshes(tmp_path / "error.png", meshes, reference=meshes["clean"], size=100)
    plain = matplotlib.image.imread(tmp_path / "plain.png")
    error = matplotlib.image.imread(tmp_path / "error.png")
    assert error.shape[0] == 2 * plain.shape[0]
    grey = abs(plain[..., 0] - plain[..., 2]) < 0.01
    assert grey.all()
    drawn = plain[..., 0] < 0.9
    half = plain.shape[1] // 2
    assert drawn[:, :half].mean() > 0.3
    assert drawn[:, half:].mean() > 0.3
    below = error[plain.shape[0] :]
    reddish = below[..., 0] - below[..., 2] > 0.3
    assert reddish[:, half:].mean() > 0.1


@pytest.mark.parametrize("with_reference", [False, True])
def test_movement_is_red_outwards_and_blue_inwards(tmp_path, meshes, with_reference):
    pos, face = meshes["clean"]
    for name, scale in (("out", 1.1), ("in", 0.9)):
        shown = {"clean": meshes["clean"], "other": (scale * pos, face)}
        draw_meshes(
            tmp_path / f"{name}.png",
            shown,
            meshes["clean"] if with_reference else None,
            moved=("clean", "other"),
            size=100,
        )
        picture = matplotlib.image.imread(tmp_path / f"{name}.png")
        rows, columns = picture.shape[0], picture.shape[1]
        panel = picture[rows // 2 :, : columns // 3] if with_reference else picture[:, 2 * columns // 3 :]
        change = (panel[..., 0] - panel[..., 2]) * (1 if name == "out" else -1)
        scale = int(np.argmax((change < -0.3).any(axis=1)))  # first row with the other colour
        assert (panel[scale - 3] == 1).all()  # white between the mesh and its scale
        assert change[: scale - 3].max() > 0.3
        assert change[: scale - 3].min() > -0.05


def test_rejects_no_mesh(tmp_path):
    with pytest.raises(ValueError, match=r"at least one mesh \(got none\)\. Pass"):
        draw_meshes(tmp_path / "none.png", {})


def test_faces_have_the_colours_of_their_values():
    scale, lower, upper = drawn(torch.tensor([1.0, 3.0]), limits=(0, 4))
    assert scale.get_clim() == (0, 4)
    np.testing.assert_allclose(hue(lower), hue(colormaps["viridis"](0.25)), atol=0.01)
    np.testing.assert_allclose(hue(upper), hue(colormaps["viridis"](0.75)), atol=0.01)


def test_faces_without_value_are_grey():
    scale, lower, upper = drawn(torch.tensor([torch.nan, 3.0]))
    assert scale.get_clim() == (3, 3)
    np.testing.assert_allclose(hue(lower), [1, 1, 1], atol=1e-5)
    assert hue(upper).min() < 0.9
    np.testing.assert_allclose(hue(drawn(None)[2]), [1, 1, 1], atol=1e-5)


def test_titles_are_not_read_as_formulas(tmp_path, meshes):
    draw_meshes(tmp_path / "picture.png", {r"$\frac{x_1.obj": meshes["noisy"]}, size=100)
    assert matplotlib.image.imread(tmp_path / "picture.png").shape[1] == 100


def test_reference_with_other_faces_gets_no_error_map(tmp_path, meshes):
    other = (meshes["clean"][0], meshes["clean"][1].flip(0))
    draw_meshes(tmp_path / "picture.png", meshes, reference=other, size=100)
    picture = matplotlib.image.imread(tmp_path / "picture.png")
    assert (picture[picture.shape[0] // 2 :] == 1).all()
