import pytest

from dnf_pyg.evaluate.benchmark.means import complete_methods, means, mesh_thetas, noisy_rows, scores, summarize
from dnf_pyg.evaluate.benchmark.rows import Row


def row(mesh, noise, method, theta, **other):
    return Row(mesh, noise, method, theta, **other)


ROWS = [
    *(row("a", noise, "x", theta) for noise, theta in zip(("n1", "n2", "n3"), (1.0, 2.0, 3.0), strict=True)),
    *(row("a", noise, "y", 5.0) for noise in ("n1", "n2", "n3")),
    *(row("a", noise, "z", 2.0 + 0.5) for noise in ("n1", "n2", "n3")),
    *(row("b", "n1", method, theta) for method, theta in (("x", 4.0), ("y", 4.0))),
]


def test_score_is_eq_4_of_the_paper():
    thetas = mesh_thetas(ROWS)
    assert thetas == {"x": {"a": 2.0, "b": 4.0}, "y": {"a": 5.0, "b": 4.0}, "z": {"a": 2.5}}
    score = scores(thetas)
    assert score["x"]["a"] == 1
    assert score["y"]["a"] == 0
    assert score["z"] == {"a": pytest.approx(1 - (2.5 - 2.0) / (5.0 - 2.0))}
    assert score["x"]["b"] == score["y"]["b"] == 1  # all equal


def test_a_mesh_with_a_missing_level_has_no_mean():
    assert mesh_thetas([*ROWS, row("b", "n2", "x", 1.0)])["y"] == {"a": 5.0}


def test_means_over_rows_that_agree_in_some_fields():
    assert means(ROWS, "theta_deg", "method") == {("x",): 2.5, ("y",): 4.75, ("z",): 2.5}
    assert means(ROWS, "theta_deg", "mesh", "noise")["a", "n1"] == pytest.approx((1 + 5 + 2.5) / 3)
    assert means([row("a", "n1", "x", 1.0), row("a", "n1", "y", 1.0, seconds=3.0)], "seconds", "mesh") == {("a",): 3.0}
    assert means(ROWS[:3], "theta_deg") == {(): 2.0}
    assert means(ROWS, "seconds") == {}


def test_noisy_meshes_as_rows():
    measured = [row("a", "n1", method, 1.0, theta_noisy_deg=9.0) for method in ("x", "y")]
    assert noisy_rows([*measured, row("b", "n1", "y", 1.0)]) == [row("a", "n1", "noisy", 9.0)]


def test_complete_methods_have_every_noisy_mesh():
    assert complete_methods(ROWS) == ["x", "y"]


def test_summary_means_over_meshes_levels_and_all():
    own = [row("a", n, "x", t, parameters="p", vertex_error=t / 10, seconds=t) for n, t in (("n1", 1.0), ("n2", 2.0))]
    summary = summarize([*own, row("b", "n1", "x", 6.0, parameters="p")], "set/test")
    assert summary["num_meshes"] == 3
    assert summary["theta_deg"] == 3.0
    assert summary["theta_by_mesh"] == {"a": 1.5, "b": 6.0}
    assert summary["theta_by_noise"] == {"n1": 3.5, "n2": 2.0}
    assert summary["vertex_error"] == pytest.approx(0.15)
    assert summary["theta_normals_deg"] is None


def test_summary_is_of_one_method():
    with pytest.raises(ValueError, match=r"one method \(got \['x', 'y', 'z'\]\)"):
        summarize(ROWS, "test")
