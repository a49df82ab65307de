import matplotlib as mpl
import numpy as np
import pytest

from dnf_pyg.evaluate.benchmark.plots import draw_plots, line_style
from dnf_pyg.evaluate.benchmark.rows import Row

ROWS = [
    Row(mesh, noise, method, theta * level)
    for mesh, theta in (("a", 1.0), ("b", 3.0))
    for level, noise in enumerate(("n1", "n2"), start=1)
    for method, theta in (("net", theta), ("peer", 1.5 * theta))
]


@pytest.mark.parametrize("rows", [[*ROWS, Row("$\\frac{x_1", "n1", "_part|", 2.0)], ROWS[:1]])
def test_three_pictures_with_something_on_them(tmp_path, rows):
    draw_plots(tmp_path, rows)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scores.png", "theta_by_mesh.png", "theta_by_noise.png"]
    for path in tmp_path.iterdir():
        picture = mpl.image.imread(path)
        assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 20


def test_no_rows_make_empty_plots(tmp_path):
    draw_plots(tmp_path, [])
    assert len(list(tmp_path.iterdir())) == 3


def test_no_two_methods_look_alike():
    styles = [line_style(number) for number in range(30)]
    assert len({(style["color"], style["marker"]) for style in styles}) == 30
