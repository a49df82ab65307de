import csv
import json

import pytest
import trimesh

from dnf_pyg.cli import main


@pytest.fixture
def data(make_test_set):
    """A ball and a box, each with noise n1 and n2."""
    box = trimesh.creation.box().subdivide().subdivide()
    return make_test_set({"ball": trimesh.creation.icosphere(subdivisions=2), "box": box})


def run(*words):
    return main(["benchmark", *(str(word) for word in words)])


def results(folder):
    with (folder / "results.csv").open() as file:
        return {(row["mesh"], row["noise"], row["method"]): row for row in csv.DictReader(file)}


def test_network_baselines_outputs_and_published_in_one_run(data, weights, tmp_path, capsys):
    out, other, published = tmp_path / "out", tmp_path / "other", tmp_path / "peers.csv"
    other.mkdir()
    for path in (data / "noisy").iterdir():
        (other / path.name).write_bytes((data / "original" / f"{path.stem[:-3]}.obj").read_bytes())
    published.write_text("mesh,noise,method,setting,theta_deg\nbox,n1,SD,oracle,0.5\ncat,n1,SD,oracle,0.5\n")
    words = [data.parent, "-o", out, "--weights", f"first={weights}", weights, "--outputs", f"perfect={other}"]
    words += ["--published", published, "--keep", "box_n2", "--num_iterations", "5"]
    assert run(*words) == 0
    rows = results(out)
    titles = {"first", "net", "BNF", "GNF", "TV", "L0", "Taubin", "perfect", "SD oracle"}
    assert {method for _, _, method in rows} == titles
    assert len(rows) == 4 * 8 + 1
    assert float(rows["box", "n1", "perfect"]["theta_deg"]) == 0
    assert float(rows["box", "n1", "perfect"]["vertex_error"]) == 0
    assert 0 < float(rows["box", "n1", "BNF"]["theta_deg"]) < float(rows["box", "n1", "BNF"]["theta_noisy_deg"])
    assert "num_iterations=5, early_stopping='auto'" in rows["box", "n1", "first"]["parameters"]
    assert "num_iterations=5, early_stopping='auto'" in rows["box", "n1", "BNF"]["parameters"]
    content = json.loads((out / "results.json").read_text())
    assert content["data"] == "set/test"
    assert content["summary"]["perfect"]["theta_deg"] == 0
    assert (out / "results.md").read_text().startswith("# Benchmark on set/test")
    for name in ("theta_by_mesh.png", "theta_by_noise.png", "scores.png", "box_n2.png"):
        assert (out / name).stat().st_size > 1000
    assert sorted(path.stem for path in (out / "meshes" / "BNF").iterdir()) == ["box_n2"]
    assert "| perfect | 0.000 | 0.000 | **0.000** |" in capsys.readouterr().out


def test_second_run_takes_finished_rows(data, tmp_path):
    words = [data, "-o", tmp_path / "out", "--weights", "--baselines", "BNF"]
    assert run(*words) == 0
    finished = (tmp_path / "out" / "finished.jsonl").read_text()
    assert run(*words) == 0
    assert (tmp_path / "out" / "finished.jsonl").read_text() == finished
    assert run(*words[:-1], "Taubin") == 0
    assert len((tmp_path / "out" / "finished.jsonl").read_text().splitlines()) == 8
    assert {method for _, _, method in results(tmp_path / "out")} == {"Taubin"}  # the table shows what was asked for


def test_meshes_and_limit(data, tmp_path):
    words = [data, "--weights", "--baselines", "Taubin"]
    run(*words, "-o", tmp_path / "a", "--meshes", "box")
    assert {key[:2] for key in results(tmp_path / "a")} == {("box", "n1"), ("box", "n2")}
    run(*words, "-o", tmp_path / "b", "--meshes", "*_n2", "--limit", "1")
    assert {key[:2] for key in results(tmp_path / "b")} == {("ball", "n2")}


def test_filters_with_their_own_vertex_update(data, tmp_path):
    words = [data, "--weights", "--baselines", "BNF", "--limit", "1"]
    run(*words, "-o", tmp_path / "shared")
    run(*words, "-o", tmp_path / "own", "--filter_update", "own")
    shared, own = (next(iter(results(tmp_path / name).values())) for name in ("shared", "own"))
    assert own["parameters"].endswith("num_vertex_iterations=20)")
    assert own["theta_normals_deg"] == shared["theta_normals_deg"]
    assert own["theta_deg"] != shared["theta_deg"]


def test_failing_mesh_is_told_at_the_end(data, tmp_path, capsys):
    (data / "noisy" / "ball_n2.obj").write_text("v 0 0 0\n")
    assert run(data, "-o", tmp_path / "out", "--weights", "--baselines", "Taubin") == 2
    captured = capsys.readouterr()
    assert "1 of 4 results failed" in captured.err
    assert "Taubin on ball_n2" in captured.err
    assert len(results(tmp_path / "out")) == 3
    assert "- ball_n2, Taubin: " in (tmp_path / "out" / "results.md").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--meshes", "cat"], "match"),
        (["--outputs", "nothing"], "TITLE=FOLDER"),
        (["--outputs", "other=absent"], "Name a folder"),
        (["--published", "absent.csv"], "absent.csv"),
    ],
)
def test_wrong_arguments(data, tmp_path, capsys, words, message):
    assert run(data, "-o", tmp_path / "out", "--weights", "--baselines", "BNF", *words) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_two_methods_of_one_title(data, weights, tmp_path, capsys):
    assert run(data, "-o", tmp_path / "out", "--weights", weights, weights) == 2
    assert "two methods called 'net'" in capsys.readouterr().err


def test_no_test_folder(tmp_path, capsys):
    assert run(tmp_path, "-o", tmp_path / "out") == 2
    assert "original/ and noisy/" in capsys.readouterr().err
