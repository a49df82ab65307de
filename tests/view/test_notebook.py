import re
from html import unescape

import numpy as np
import pytest
import torch
from matplotlib import colormaps
from matplotlib.figure import Figure

from dnf_pyg.errors import DataError
from dnf_pyg.view.notebook import PageView, draw_faces
from dnf_pyg.view.raster import Camera

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


def test_page_is_in_the_frame_whole(tmp_path):
    page = "<!doctype html><p title=\"a & b\">'x'</p>"
    (tmp_path / "page.html").write_text(page)
    frame = PageView(tmp_path / "page.html", height=300)._repr_html_()
    assert unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]) == page
    assert "height: 300px" in frame


def test_missing_page_is_named(tmp_path):
    with pytest.raises(DataError, match=r"got '.*absent.html': No such file or directory\): write it first"):
        PageView(tmp_path / "absent.html")


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
