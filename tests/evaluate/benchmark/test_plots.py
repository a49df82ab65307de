import matplotlib as mpl
import numpy as np

from dnf_pyg.evaluate.benchmark import Row, draw_plots

ROWS = [
    Row(mesh, noise, method, theta * level)
    for mesh, theta in (("a", 1.0), ("b", 3.0))
    for level, noise in enumerate(("n1", "n2"), start=1)
    for method, theta in (("net", theta), ("peer", 1.5 * theta))
]


def test_three_pictures_with_something_on_them(tmp_path):
    paths = draw_plots(tmp_path, [*ROWS, Row("a", "n1", "part", 2.0)])
    assert sorted(path.name for path in paths) == ["scores.png", "theta_by_mesh.png", "theta_by_noise.png"]
    for path in paths:
        picture = mpl.image.imread(path)
        assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 20


def test_no_rows_make_empty_plots(tmp_path):
    assert all(path.is_file() for path in draw_plots(tmp_path, []))
