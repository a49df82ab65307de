import csv
import os
import re

import pytest
import torch
import trimesh

from dnf_pyg.cli import main
from dnf_pyg.commands.experiment import find_run
from dnf_pyg.evaluate.experiments import CASES
from dnf_pyg.nn import DNFNet
from dnf_pyg.nn.config import describe_network


@pytest.fixture
def data(make_test_set):
    """Two of the paper's meshes, tiny, each with noise n1 and n2, and another mesh."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    return make_test_set({"Cube": trimesh.creation.box().subdivide().subdivide(), "sphere": ball, "other": ball})


def run(*words):
    return main(["experiment", *(str(word) for word in words)])


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_ablation_takes_finished_runs(data, weights, tmp_path, capsys):
    net = DNFNet.from_pretrained(weights)
    for name in ("ablation_wo_sub/version_0/checkpoints", "synthetic/version_1/checkpoints"):
        (tmp_path / "runs" / name).mkdir(parents=True)
        state = {f"net.{key}": value for key, value in net.state_dict().items()}
        torch.save({"network": describe_network(net), "state_dict": state}, tmp_path / "runs" / name / "best.ckpt")
    words = [data.parent, "-o", tmp_path / "out", "--runs", tmp_path / "runs", "--weights", f"1_unit={weights}"]
    assert run("ablation", *words, "--num_iterations", "2") == 0
    rows = {(row["case"], row["mesh"]): row for row in table(tmp_path / "out" / "ablation.csv")}
    assert len(rows) == 6 * 5
    assert rows["full", "cube"]["theta_deg"] == rows["wo_sub", "cube"]["theta_deg"] != ""
    assert rows["full", "cube"]["paper_theta_deg"] == "0.96"
    assert rows["wo_reg", "cube"]["theta_deg"] == rows["full", "block"]["theta_deg"] == ""
    text = (tmp_path / "out" / "ablation.md").read_text()
    assert "| full pipeline |  | 2.12 | **" in text
    assert str(weights) in text
    assert "| w/o reg |  | 2.43 |  | 1.13 |" in capsys.readouterr().out
    assert (tmp_path / "out" / "ablation.png").stat().st_size > 5000


def test_table_1_from_its_configs_cut_short(data, cnr_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = ["--trainer.max_epochs=1", "--trainer.limit_train_batches=2", "--trainer.limit_val_batches=1"]
    short += [f"--model.net.{option}" for option in ("channels=[8,8,8]", "embedding_channels=8", "residual_k=4")]
    small = ("cache=cache", "patches.num_patches=2", "patches.patch_size=60")
    short += [f"--data.{option}" for option in (f"root={cnr_folder}", *small)]
    for case in CASES.values():
        assert main(["fit", "-c", case.runs[-1], "--trainer.accelerator=cpu", *short]) == 0
    assert run("ablation", data, "-o", "out", "--num_iterations", "2") == 0
    rows = {(row["case"], row["mesh"]): row for row in table(tmp_path / "out" / "ablation.csv")}
    thetas = {tuple(float(rows[case, mesh]["theta_deg"]) for mesh in ("cube", "sphere")) for case in CASES}
    assert len(thetas) == 6  # a network of its own in each row
    assert all(0 < theta < 90 for of_case in thetas for theta in of_case)
    listed = (tmp_path / "out" / "ablation.md").read_text().partition("## Runs")[2]
    assert [f"runs/{case.runs[-1]}/version_0/checkpoints/best.ckpt" in listed for case in CASES.values()] == [True] * 6


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("resolution", ["1", "2"]),
        ("triangulation", ["0", "1"]),
        ("noise-kinds", ["uniform", "impulsive"]),
        ("noise-levels", ["0.1", "0.7"]),
    ],
)
def test_series(data, weights, tmp_path, name, settings):
    words = ["series", name, data, "-o", tmp_path / "out", "--weights", f"ours={weights}", "--baselines", "Taubin"]
    words += ["--meshes", "sphere", "--num_iterations", "2", "--settings", *settings]
    assert run(*words) == 0
    rows = table(tmp_path / "out" / f"{name}.csv")
    assert [(row["setting"], row["method"]) for row in rows] == [(s, m) for s in settings for m in ("ours", "Taubin")]
    text = (tmp_path / "out" / f"{name}.md").read_text()
    mean = float(rows[0]["theta_deg"])
    assert any(float(number) == pytest.approx(mean, abs=6e-4) for number in re.findall(r"\d+\.\d{3}", text))
    assert (tmp_path / "out" / f"{name}.png").stat().st_size > 5000
    finished = (tmp_path / "out" / "finished.jsonl").read_text()
    assert run(*words) == 0
    assert (tmp_path / "out" / "finished.jsonl").read_text() == finished


def test_series_tests_the_network_of_the_paper_and_counts_faces(data, tmp_path):
    words = ["series", "resolution", data, "-o", tmp_path / "out", "--meshes", "sphere", "other"]
    assert run(*words, "--baselines", "--num_iterations", "1", "--settings", "1", "4") == 0
    rows = table(tmp_path / "out" / "resolution.csv")
    assert [row["method"] for row in rows] == ["synthetic", "best"] * 4
    faces = {row["setting"]: row["num_faces"] for row in rows}
    assert faces["1"] == "320"
    lines = (tmp_path / "out" / "resolution.md").read_text().splitlines()
    assert "| number of faces | noisy | synthetic | best |" in lines
    assert [sum(line.startswith(f"| {number} |") for line in lines) for number in faces.values()] == [3, 3]


def test_newest_checkpoint_of_the_first_run_that_has_one(tmp_path):
    for number, name in enumerate(("a/version_0/best.ckpt", "a/version_1/best-v1.ckpt", "b/best.ckpt")):
        path = tmp_path / name
        path.parent.mkdir(parents=True)
        path.touch()
        os.utime(path, (number, number))
    assert find_run(tmp_path, ["none", "a", "b"]) == tmp_path / "a" / "version_1" / "best-v1.ckpt"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ablation", "--runs", "absent"], "ablation_wo_inter"),
        (["ablation", "--weights", "mine=best"], "CASE=WEIGHTS"),
        (["ablation", "--weights", "full=best", "--meshes", "other"], "match"),
        (["series", "noise-levels", "--settings", "0.8"], "0.8"),
        (["series", "noise-levels", "--weights", "best", "best"], "two methods called 'best'"),
    ],
)
def test_wrong_arguments(data, tmp_path, capsys, words, message):
    names = words[: 1 + (words[0] == "series")]
    assert run(*names, data, "-o", tmp_path / "out", *words[len(names) :]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
