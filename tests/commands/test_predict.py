"""The command ``dnf-pyg predict``: many files, on one process and on two."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch
import trimesh

from dnf_pyg import DataError, FilterOptions, MeshFileError, OutputError, UpdateOptions, denoise, load_network
from dnf_pyg.cli import main
from dnf_pyg.datamodules import MeshFilesDataModule
from dnf_pyg.datamodules.mesh_files import equal_shares
from dnf_pyg.io import read_mesh
from dnf_pyg.nn import DNFNet

SETTINGS = ["--patch_size", "100", "--num_iterations", "3"]
ON_CPU = ["--trainer.accelerator", "cpu"]


@pytest.fixture
def folders(tmp_path):
    torch.manual_seed(0)
    DNFNet(k=(3, 4, 5), channels=(8, 8, 8), embedding_channels=8, residual_k=3).save_pretrained(tmp_path / "weights")
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    for number in range(4):
        ball = trimesh.creation.icosphere(subdivisions=1 + number % 2)
        ball.vertices += 0.02 * torch.randn(ball.vertices.shape, generator=torch.Generator().manual_seed(0)).numpy()
        ball.export(tmp_path / "in" / f"mesh{number}.ply")
    return tmp_path


def words(folders, *more):
    inside = [folders / "in", "-o", folders / "out", "--weights", folders / "weights", *SETTINGS, *ON_CPU, *more]
    return ["predict", *map(str, inside)]


def test_failing_file_is_reported_at_the_end_and_a_restart_does_the_rest(folders, capfd, caplog):
    good = (folders / "in" / "mesh1.ply").read_bytes()
    (folders / "in" / "mesh1.ply").write_bytes(good[:-20])
    assert main(words(folders)) == 2
    told = capfd.readouterr().err
    assert "1 of 4 meshes failed" in told.splitlines()[-1]
    assert "mesh1.ply" in told.splitlines()[-1]
    assert "Traceback" not in told
    done = {path.name: path.stat().st_mtime_ns for path in (folders / "out").iterdir()}
    assert set(done) == {"mesh0.ply", "mesh2.ply", "mesh3.ply"}

    (folders / "in" / "mesh1.ply").write_bytes(good)
    assert main(words(folders, "--json")) == 0
    out = capfd.readouterr().out
    assert [Path(json.loads(line)["output"]).name for line in out.splitlines()] == ["mesh1.ply"]
    assert "3 of 4 outputs already there" in caplog.text
    assert all((folders / "out" / name).stat().st_mtime_ns == when for name, when in done.items())

    mesh = read_mesh(folders / "in" / "mesh1.ply")
    expected = denoise(
        mesh.mesh,
        load_network(folders / "weights"),
        filtering=FilterOptions(patch_size=100),
        update=UpdateOptions(num_iterations=3),
    ).pos
    torch.testing.assert_close(read_mesh(folders / "out" / "mesh1.ply").pos, expected, rtol=1e-5, atol=1e-6)


def test_default_weights_are_a_cascade_and_give_the_result_of_denoise(folders):
    source, output = folders / "in" / "mesh0.ply", folders / "out"
    assert main(["predict", str(source), "-o", str(output), *ON_CPU]) == 0
    expected = denoise(read_mesh(source).mesh).pos
    torch.testing.assert_close(read_mesh(output / "mesh0.ply").pos, expected, rtol=1e-5, atol=1e-6)


def test_two_processes_share_the_files(folders):
    (folders / "in" / "broken.ply").write_text("no mesh")
    script = Path(sys.executable).with_name("dnf-pyg")
    command = [script, *words(folders, "--trainer.devices", "2", "--json")]
    quiet = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, env=quiet, timeout=900)
    assert done.returncode == 2, done.stderr
    assert "1 of 5 meshes failed" in done.stderr.splitlines()[-1]
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert sorted(Path(values["input"]).name for values in told) == [f"mesh{number}.ply" for number in range(4)]
    assert {values["process"] for values in told} == {0, 1}
    shared = {path.name: path.read_bytes() for path in (folders / "out").iterdir()}
    assert main(words(folders, "--overwrite")) == 2
    assert shared == {path.name: path.read_bytes() for path in (folders / "out").iterdir()}


def test_fault_of_the_program_stops_one_file_only(folders, capsys, monkeypatch):
    def faulty(mesh, *_, **__):
        if mesh.face.size(1) == 80:
            raise ZeroDivisionError("by a fault")
        return denoise(mesh, load_network(folders / "weights"), filtering=FilterOptions(patch_size=100))

    monkeypatch.setattr("dnf_pyg.train.prediction.denoise", faulty)
    assert main(words(folders)) == 2
    assert "2 of 4 meshes failed" in capsys.readouterr().err
    assert [path.name for path in sorted((folders / "out").iterdir())] == ["mesh1.ply", "mesh3.ply"]


def test_options_from_a_file(folders, capsys):
    (folders / "many.yaml").write_text("patch_size: 100\nfast: true\ntrainer:\n  accelerator: cpu\n  devices: 1\n")
    inside = [folders / "in", "-o", folders / "out", "--weights", folders / "weights", "-c", folders / "many.yaml"]
    assert main(["predict", *map(str, inside), "--json"]) == 0
    fast = json.loads(capsys.readouterr().out.splitlines()[0])
    assert main(words(folders, "--overwrite", "--json")) == 0
    assert fast["mean_coverage"] < json.loads(capsys.readouterr().out.splitlines()[0])["mean_coverage"]


def test_shares_are_equal_and_complete():
    sizes = [7, 1, 1, 1, 1, 1, 1, 1]
    shares = equal_shares(sizes, 2)
    assert sorted(item for share in shares for item in share) == list(range(8))
    assert [sum(sizes[item] for item in share) for share in shares] == [7, 7]
    assert equal_shares([3], 2) == [[0], []]


def test_nothing_left_to_do(folders, caplog):
    for path in (folders / "in").iterdir():
        (folders / "out" / path.name).write_bytes(b"done")
    assert main(words(folders)) == 0
    assert "4 of 4 outputs already there" in caplog.text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"output": "absent"}, "writable folder"),
        ({"output": "in"}, "another folder"),
        ({"inputs": ["absent.ply"]}, "does not exist"),
        ({"inputs": ["out"]}, "without any"),
    ],
)
def test_wrong_folders(folders, monkeypatch, change, text):
    monkeypatch.chdir(folders)
    with pytest.raises((DataError, MeshFileError, OutputError), match=text):
        MeshFilesDataModule(**{"inputs": ["in"], "output": "out", **change})


@pytest.mark.parametrize(
    ("more", "text"),
    [
        (["--weights", "nonesuch"], "nonesuch"),
        (["--trainer.nonesuch", "1"], "nonesuch"),
        (["--strength", "2"], "from 0 to 1"),
        (["--trainer.accelerator", "nonesuch"], "nonesuch"),
    ],
)
def test_wrong_options_are_one_line(folders, capsys, more, text):
    assert main(words(folders, *more)) == 2
    told = capsys.readouterr().err.strip()
    assert text in told
    assert "\n" not in told
