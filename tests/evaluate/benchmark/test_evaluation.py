import pytest

from dnf_pyg.datasets.pairing import pair_meshes
from dnf_pyg.evaluate.benchmark import RowLog, run_benchmark
from dnf_pyg.evaluate.metrics import MeanAngularDifference, VertexError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.geometry import face_normals


def test_rows_hold_what_the_metrics_give(test_set, tmp_path, scaled):
    pairs = pair_meshes(test_set)
    rows, failures = run_benchmark(pairs, [scaled("same"), scaled("twice", 2.0)], RowLog(tmp_path / "log"))
    assert not failures
    assert [(row.mesh, row.noise, row.method) for row in rows[:3]] == [
        ("ball", "n1", "same"), ("ball", "n1", "twice"), ("ball", "n2", "same"),
    ]  # fmt: skip
    for row in rows:
        noisy = read_mesh(test_set / "noisy" / f"{row.mesh}_{row.noise}.obj")
        clean = read_mesh(test_set / "original" / f"{row.mesh}.obj")
        theta = MeanAngularDifference()(face_normals(noisy.pos, noisy.face), face_normals(clean.pos, clean.face))
        assert row.theta_deg == pytest.approx(float(theta))  # scaling turns no face
        assert row.theta_noisy_deg == row.theta_normals_deg == pytest.approx(float(theta))
        factor = 2.0 if row.method == "twice" else 1.0
        assert row.vertex_error == pytest.approx(float(VertexError()(factor * noisy.pos, clean.pos, clean.face)))
        assert row.num_faces == noisy.face.size(1)
        assert row.seconds == 0.5


def test_a_second_run_computes_only_what_is_new(test_set, tmp_path, scaled):
    pairs, log = pair_meshes(test_set), tmp_path / "log"
    first, _ = run_benchmark(pairs, [scaled("a")], RowLog(log))
    again, other, changed = scaled("a"), scaled("b"), scaled("a", 2.0)
    rows, _ = run_benchmark(pairs, [again, other], RowLog(log))
    assert again.calls == []
    assert len(other.calls) == 4
    assert [row for row in rows if row.method == "a"] == first
    run_benchmark(pairs, [changed], RowLog(log))
    assert len(changed.calls) == 4


def test_a_changed_mesh_is_computed_again(test_set, tmp_path, scaled):
    pairs, log = pair_meshes(test_set), tmp_path / "log"
    run_benchmark(pairs, [scaled("a")], RowLog(log))
    with pairs[1][0].open("a") as file:
        file.write("# touched\n")
    again = scaled("a")
    run_benchmark(pairs, [again], RowLog(log))
    assert again.calls == [pairs[1][0].stem]


def test_a_cut_off_run_goes_on(test_set, tmp_path, scaled):
    pairs, log = pair_meshes(test_set), tmp_path / "log"
    whole, _ = run_benchmark(pairs, [scaled("a")], RowLog(log))
    lines = log.read_text().splitlines(keepends=True)
    log.write_text("".join(lines[:2]) + lines[2][:30])
    again = scaled("a")
    rows, _ = run_benchmark(pairs, [again], RowLog(log))
    assert again.calls == [noisy.stem for noisy, _ in pairs[2:]]
    assert rows == whole
    assert RowLog(log).rows == whole


def test_failures_are_told_and_tried_again(test_set, tmp_path, scaled):
    pairs, log = pair_meshes(test_set), tmp_path / "log"
    (test_set / "noisy" / "box_n1.obj").write_text("v 0 0 0\n")
    rows, failures = run_benchmark(pairs, [scaled("a", fails_on="ball_n2"), scaled("b")], RowLog(log))
    assert [(row.mesh, row.noise, row.method) for row in rows] == [
        ("ball", "n1", "a"), ("ball", "n1", "b"), ("ball", "n2", "b"), ("box", "n2", "a"), ("box", "n2", "b"),
    ]  # fmt: skip
    assert [(failure.noisy, failure.method) for failure in failures] == [
        ("ball_n2", "a"), ("box_n1", "a"), ("box_n1", "b"),
    ]  # fmt: skip
    assert failures[0].reason == "cannot do that"
    assert "triangles" in failures[1].reason
    again = scaled("a")
    run_benchmark(pairs, [again], RowLog(log))
    assert again.calls == ["ball_n2"]


def test_meshes_with_other_faces_than_the_clean_one(test_set, tmp_path, scaled):
    (test_set / "noisy" / "ball_n1.obj").write_bytes((test_set / "noisy" / "box_n1.obj").read_bytes())
    _, failures = run_benchmark(pair_meshes(test_set)[:1], [scaled("a")], RowLog(tmp_path / "log"))
    assert "Expected a noisy mesh with the" in failures[0].reason


def test_a_result_that_is_not_finite_is_a_failure(test_set, tmp_path, scaled):
    _, failures = run_benchmark(pair_meshes(test_set)[:1], [scaled("a", float("nan"))], RowLog(tmp_path / "log"))
    assert "finite" in failures[0].reason


class Seen:
    """A store that has all meshes but those of the given name."""

    def __init__(self, lost=None):
        self.lost, self.written = lost, []

    def has(self, noisy, method):
        return noisy != self.lost

    def write(self, noisy, method, result):
        self.written.append((noisy.path.stem, method.name, len(result.pos)))


def test_results_are_stored_and_computed_again_where_the_store_lost_them(test_set, tmp_path, scaled):
    pairs, log, store = pair_meshes(test_set), tmp_path / "log", Seen()
    run_benchmark(pairs, [scaled("a")], RowLog(log), store=store)
    assert store.written == [("ball_n1", "a", 162), ("ball_n2", "a", 162), ("box_n1", "a", 26), ("box_n2", "a", 26)]
    again = scaled("a")
    run_benchmark(pairs, [again], RowLog(log), store=Seen(lost="box_n1"))
    assert again.calls == ["box_n1"]


def test_progress_is_told_before_each_result(test_set, tmp_path, scaled):
    told = []
    run_benchmark(pair_meshes(test_set), [scaled("a"), scaled("b")], RowLog(tmp_path / "log"), progress=told.append)
    assert told[:2] == ["ball_n1, a", "ball_n1, b"]
    assert len(told) == 8


def test_two_methods_of_one_name(test_set, tmp_path, scaled):
    with pytest.raises(ValueError, match="different names"):
        run_benchmark(pair_meshes(test_set), [scaled("a"), scaled("a")], RowLog(tmp_path / "log"))
