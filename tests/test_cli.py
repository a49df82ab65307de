import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch
import trimesh

from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh
from dnf_pyg.nn import DNFNet

SMALL = {"k": (3, 5, 8), "residual_k": 4, "channels": (8, 8, 8), "embedding_channels": 8}


@pytest.fixture
def clean_file(tmp_path):
    path = tmp_path / "clean.ply"
    trimesh.creation.icosphere(subdivisions=3).export(path)
    return path


@pytest.fixture
def noisy_file(clean_file):
    path = clean_file.with_name("noisy.ply")
    assert main(["add-noise", str(clean_file), "-o", str(path), "--level", "0.2", "--seed", "3"]) == 0
    return path


@pytest.fixture
def weights(tmp_path):
    torch.manual_seed(0)
    DNFNet(**SMALL).save_pretrained(tmp_path / "weights")
    return tmp_path / "weights"


def failure(capsys, *words):
    """Run a command that must fail; its one line on stderr."""
    assert main([str(word) for word in words]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    for command in ("fit", "validate", "test", "predict", "denoise", "compare", "add-noise", "configs"):
        assert f"\n    {command} " in text


def test_add_noise_is_seeded_and_of_the_level_asked(clean_file, noisy_file, tmp_path):
    clean, noisy = read_mesh(clean_file), read_mesh(noisy_file)
    edges = trimesh.load(clean_file, process=False).edges_unique_length.mean()
    moved = (noisy.pos - clean.pos).norm(dim=-1) / edges
    assert float(moved.square().mean().sqrt()) == pytest.approx(0.2, rel=0.1)  # 642 samples
    again = tmp_path / "again.ply"
    main(["add-noise", str(clean_file), "-o", str(again), "--level", "0.2", "--seed", "3"])
    assert again.read_bytes() == noisy_file.read_bytes()


def test_compare_prints_json(clean_file, noisy_file, capsys):
    assert main(["compare", str(noisy_file), str(clean_file), "--json"]) == 0
    noisy = json.loads(capsys.readouterr().out)
    assert main(["compare", str(clean_file), str(clean_file), "--json"]) == 0
    same = json.loads(capsys.readouterr().out)
    assert same["theta"] == pytest.approx(0, abs=1e-9)
    assert same["within_5_degrees"] == 1
    assert same["vertex_error"] == pytest.approx(0, abs=1e-9)
    assert 10 < noisy["theta"] < 30
    assert 0.05 < noisy["vertex_error"] < 0.3


def test_denoise_keeps_faces_and_prints_theta(noisy_file, clean_file, weights, tmp_path, capsys):
    output = tmp_path / "denoised.ply"
    words = ["denoise", noisy_file, "-o", output, "--weights", weights, "--reference", clean_file]
    assert main([str(word) for word in words]) == 0
    text = capsys.readouterr().out
    assert text.count("theta of the") == 3
    before, after = read_mesh(noisy_file), read_mesh(output)
    torch.testing.assert_close(after.face, before.face)
    assert after.pos.isfinite().all()


def test_missing_file(capsys, tmp_path):
    assert "absent.obj" in failure(capsys, "denoise", tmp_path / "absent.obj", "-o", tmp_path / "out.obj")


def test_unreadable_file(capsys, tmp_path):
    path = tmp_path / "text.ply"
    path.write_text("this is no mesh\n")
    assert "text.ply" in failure(capsys, "compare", path, path)


def test_no_triangles(capsys, tmp_path):
    path = tmp_path / "cloud.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    assert "triangles" in failure(capsys, "compare", path, path)


def test_unknown_weights(capsys, noisy_file, tmp_path):
    message = failure(capsys, "denoise", noisy_file, "-o", tmp_path / "out.ply", "--weights", "nonesuch")
    assert "nonesuch" in message
    assert not (tmp_path / "out.ply").exists()


def test_reference_with_other_faces(capsys, noisy_file, tmp_path):
    other = tmp_path / "other.ply"
    trimesh.creation.icosphere(subdivisions=1).export(other)
    assert "got 80 faces" in failure(capsys, "compare", noisy_file, other)


def test_config_key_that_does_not_exist(capsys):
    assert "modle" in failure(capsys, "fit", "-c", "demo", "--modle.lr", "1")


def test_unknown_config_names_the_known_ones(capsys):
    message = failure(capsys, "fit", "-c", "nonesuch")
    assert "nonesuch" in message
    assert "synthetic" in message


def test_configs_are_listed_and_copied(capsys, tmp_path):
    assert main(["configs"]) == 0
    assert "synthetic" in capsys.readouterr().out
    copy = tmp_path / "mine.yaml"
    assert main(["configs", "demo", "-o", str(copy)]) == 0
    assert "dnf_pyg.nn.DNFNet" in copy.read_text()
    assert "mine.yaml" in failure(capsys, "configs", "demo", "-o", copy)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["add-noise", "a.ply", "-o", "b.ply", "--level", "-1"], "--level: Expected a number of at least 0 (got -1)"),
        (
            ["make-shape", "blob", "-o", "b.ply", "--faces", "0"],
            "--faces: Expected a whole number of at least 1 (got 0)",
        ),
        (["denoise", "a.ply", "-o", "b.ply", "--seed", "-1"], "--seed: Expected a whole number from 0 to"),
        (["denoise", "a.ply", "-o", "b.ply", "--iterations", "2.5"], "a whole number of at least 1 (got 2.5)"),
        (["denoise", "a.ply", "-o", "b.ply", "--patch-size", "99999"], "from 1 to 32767 (got 99999)"),
        (["denoise", "a.ply", "-o", "b.ply", "--strength", "half"], "Expected a number from 0 to 1 (got half)"),
        (["denoise", "", "-o", "b.ply"], "Expected a path (got an empty word)"),
        (["denoize"], "invalid choice: 'denoize' (choose from 'denoise'"),
    ],
)
def test_wrong_words_are_refused_in_one_line(words, told, capsys):
    assert told in failure(capsys, *words)


def test_reader_that_has_gone_is_no_fault(noisy_file, weights, tmp_path):
    script = Path(sys.executable).with_name("dnf-pyg")
    words = [script, "compare", noisy_file, noisy_file]
    gone, closed = (
        subprocess.run(["/bin/sh", "-c", f'"$0" "$@" {how}', *map(str, words)], stderr=subprocess.PIPE, text=True)
        for how in ("| true", ">&-")
    )
    assert (gone.stderr, closed.stderr, closed.returncode) == ("", "", 0)


def test_validation_beyond_the_end_of_an_epoch_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    few = ["--data.kinds=[blob]", "--data.num_meshes=2", "--data.num_faces=500", "--data.patches.num_patches=4"]
    assert main(["fit", "-c", "demo", "--trainer.callbacks=null", *few]) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("dnf-pyg:")]
    assert len(told) == 1
    assert "`val_check_interval` (100) must be less than or equal to the number of the training batches (1)" in told[0]
