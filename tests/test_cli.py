import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
import torch
import trimesh

import dnf_pyg
from dnf_pyg.cli import main
from dnf_pyg.commands import COMMANDS, LIGHTNING
from dnf_pyg.io import read_mesh, write_mesh
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
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for command in [*COMMANDS, *LIGHTNING]:
        assert f"\n    {command} " in text
    assert text.index("dnf-pyg denoise noisy.obj") < text.index("commands:")
    assert main([]) == 0
    assert capsys.readouterr().out == text


@pytest.mark.parametrize("words", [["experiment"], ["experiment", "--help"]])
def test_commands_of_a_group(words, capsys):
    assert main(words) == 0
    assert "\n    experiment ablation " in capsys.readouterr().out


@pytest.mark.parametrize("words", [["-V"], ["--version"]])
def test_version(words, capsys):
    assert main(words) == 0
    assert capsys.readouterr().out == f"{dnf_pyg.__version__}\n"


def test_runs_as_a_module():
    done = subprocess.run([sys.executable, "-m", "dnf_pyg", "-V"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"{dnf_pyg.__version__}\n")


HEAVY = ("torch", "lightning", "trimesh", "numba", "matplotlib", "numpy", "scipy", "torch_geometric")


@pytest.mark.parametrize(
    "words",
    [
        ["--help"], ["--version"], ["configs"], ["configs", "demo"], ["weights"], ["denoise", "--help"], ["fit"],
        ["denoize"], ["experiment", "seri"], ["denoise", "a.obj", "--strenght", "1"], ["compare"],
        ["make-shape", "blob"], ["experiment", "series", "noise-levels", "--dta"],
        ["denoise", "a.obj", "--strength", "2"], ["benchmark"], ["completion", "bash"],
    ],
    ids=" ".join,
)  # fmt: skip
def test_help_and_typing_errors_import_nothing_heavy(words):
    code = (
        f"import sys, contextlib, dnf_pyg.cli\nwith contextlib.suppress(SystemExit):\n    dnf_pyg.cli.main({words})\n"
    )
    code += f"print('LOADED', sorted(set({HEAVY}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "LOADED []", done.stderr


def test_importing_the_package_is_light_and_changes_no_environment():
    code = (
        "import os, sys; before = dict(os.environ); import dnf_pyg; "
        f"assert not set({HEAVY}) & set(sys.modules), sorted(sys.modules); assert dict(os.environ) == before; "
        "dnf_pyg.denoise, dnf_pyg.load_network; assert dict(os.environ) == before; assert 'torch' in sys.modules; "
        "assert set(dnf_pyg.__all__) <= set(dir(dnf_pyg))"
    )
    quiet = {name: value for name, value in os.environ.items() if name != "GOMP_SPINCOUNT"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=quiet)
    assert done.returncode == 0, done.stderr


def test_unknown_name_of_the_package():
    with pytest.raises(AttributeError, match="'dnf_pyg' has no attribute 'denoize'"):
        _ = dnf_pyg.denoize


def test_program_lets_idle_threads_sleep_before_torch_is_imported(monkeypatch, capsys):
    monkeypatch.delenv("GOMP_SPINCOUNT", raising=False)
    assert main(["-V"]) == 0
    assert os.environ["GOMP_SPINCOUNT"] == "30000"
    monkeypatch.setenv("GOMP_SPINCOUNT", "5")
    assert main(["-V"]) == 0
    assert os.environ["GOMP_SPINCOUNT"] == "5"


def test_names_with_terminal_sequences_are_escaped(capsys, tmp_path, weights):
    name = "a\x1b[31m\nb.ply"
    assert r"a\x1b[31m b.ply" in failure(capsys, "compare", tmp_path / name, tmp_path / name)
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "ball.ply")
    (tmp_path / "ball.ply").rename(tmp_path / name)
    (tmp_path / "out").mkdir()
    (tmp_path / "bad\x1b.ply").write_text("no mesh")
    assert main(["denoise", str(tmp_path), "-o", str(tmp_path / "out"), "--weights", str(weights)]) == 2
    assert main(["denoise", str(tmp_path), "-o", str(tmp_path / "out"), "--weights", str(weights)]) == 2
    told = "".join(capsys.readouterr())
    assert r"a\x1b[31m\nb.ply: " in told
    assert r"already there" in told
    assert "\x1b" not in told


def test_terminal_that_cannot_show_a_name(tmp_path, weights):
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "ball.ply")
    (tmp_path / "ball.ply").rename(tmp_path / "kätzchen猫.ply")
    words = ["denoise", str(tmp_path / "kätzchen猫.ply"), "--weights", str(weights)]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-m", "dnf_pyg", *words], capture_output=True, text=True, env=environment)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert r"k\xe4tzchen\u732b_denoised.ply" in done.stdout


def test_warnings_are_one_line(capsys, monkeypatch):
    def warn(options):
        warnings.warn("a\x1b name", DNFWarning, stacklevel=1)
        warnings.warn("of others", UserWarning, stacklevel=1)

    class DNFWarning(UserWarning):
        """Stands in for those of the package."""

    DNFWarning.__module__ = "dnf_pyg.errors"
    monkeypatch.setattr("dnf_pyg.commands.configs.run", warn)
    assert main(["configs"]) == 0
    first, second = capsys.readouterr().err.splitlines()
    assert first == r"warning: a\x1b name"
    assert second.endswith("UserWarning: of others")


@pytest.mark.parametrize("command", ["fit", "validate", "test"])
def test_training_needs_a_config(command, capsys):
    assert f"Expected -c CONFIG after `dnf-pyg {command}` (got nothing). `dnf-pyg configs`" in failure(capsys, command)


@pytest.mark.parametrize("command", ["fit", "predict"])
def test_training_without_lightning_names_the_extra(command, capsys, monkeypatch):
    monkeypatch.setattr("dnf_pyg.cli.find_spec", lambda name: None)
    assert 'pip install ".[train]"' in failure(capsys, command, "-c", "demo")


def test_serving_without_gradio_names_the_extra(capsys, monkeypatch):
    monkeypatch.setattr("dnf_pyg.cli.find_spec", lambda name: None)
    told = failure(capsys, "serve")
    assert "Expected Gradio for `dnf-pyg serve`" in told
    assert 'pip install ".[serve]"' in told


def test_denoising_and_layers_need_nothing_of_training(tmp_path):
    """Runs without the packages of the extra ``train``, as after a plain installation."""
    trimesh.creation.icosphere(subdivisions=2).export(tmp_path / "ball.ply")
    code = (
        "import sys\nfor name in ('lightning', 'tensorboard', 'pytorch_lightning'): sys.modules[name] = None\n"
        "import dnf_pyg.nn, dnf_pyg.transforms, dnf_pyg.datasets, dnf_pyg.evaluate.benchmark\n"
        "from dnf_pyg.cli import main\n"
        f"ball, out = {str(tmp_path / 'ball.ply')!r}, {str(tmp_path / 'out.ply')!r}\n"
        "words = ['--reference', ball, '--picture', out + '.png', '--report', out + '.html', '--fast']\n"
        "sys.exit(main(['denoise', ball, '-o', out, *words]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_folder_called_like_one_of_ours_beside_the_script_is_no_trouble(tmp_path):
    (tmp_path / "datamodules").mkdir()
    (tmp_path / "datamodules" / "__init__.py").write_text("raise ImportError('not this one')")
    (tmp_path / "script.py").write_text(
        "from dnf_pyg.datamodules import PairsDataModule\nfrom dnf_pyg.cli import main\n"
        "print(PairsDataModule.__module__, main(['configs', 'demo', '-o', 'demo.yaml']))"
    )
    done = subprocess.run([sys.executable, "script.py"], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout == "dnf_pyg.datamodules.pairs 0\n", done.stderr


@pytest.mark.parametrize("command", [["make-shape", "blob", "--faces", "300"], ["add-noise", "clean.ply"]])
def test_output_is_replaced_on_demand_only(command, clean_file, capsys, monkeypatch):
    monkeypatch.chdir(clean_file.parent)
    clean_file.with_name("out.ply").write_bytes(b"precious")
    assert "Add --overwrite to replace it." in failure(capsys, *command, "-o", "out.ply")
    assert clean_file.with_name("out.ply").read_bytes() == b"precious"
    assert main([*command, "-o", "out.ply", "--overwrite"]) == 0
    assert read_mesh("out.ply").face.size(1) > 100


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


def test_compare_with_a_reference_of_another_order(clean_file, noisy_file, tmp_path, capsys):
    assert main(["compare", str(noisy_file), str(clean_file), "--json"]) == 0
    expected = json.loads(capsys.readouterr().out)
    clean = read_mesh(clean_file)
    order = torch.randperm(clean.face.size(1), generator=torch.Generator().manual_seed(0))
    shuffled = trimesh.Trimesh(clean.pos.numpy(), clean.face[:, order].t().numpy(), process=False)
    write_mesh(shuffled, clean.pos, tmp_path / "shuffled.ply")
    assert main(["compare", str(noisy_file), str(tmp_path / "shuffled.ply"), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out) == pytest.approx(expected, abs=1e-4)
    assert "shuffled.ply' are in another order than those of" in told.err


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
    listed = capsys.readouterr().out.splitlines()
    assert any(line.startswith("synthetic ") for line in listed)
    assert all(line.split()[0] == "Takes" for line in listed[1::2])
    copy = tmp_path / "mine.yaml"
    assert main(["configs", "demo", "-o", str(copy)]) == 0
    assert "seed_everything" in copy.read_text()
    assert "mine.yaml" in failure(capsys, "configs", "demo", "-o", copy)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["add-noise", "a.ply", "-o", "b.ply", "--level", "-1"], "'level' to be a number of at least 0 (got -1.0)"),
        (
            ["make-shape", "blob", "-o", "b.ply", "--faces", "0"],
            "'faces' to be a whole number of at least 1 (got 0)",
        ),
        (["denoise", "a.ply", "-o", "b.ply", "--seed", "-1"], "'seed' to be a whole number from 0 to"),
        (
            ["denoise", "a.ply", "-o", "b.ply", "--num_iterations", "2.5"],
            "'num_iterations' to be a whole number (got 2.5)",
        ),
        (["denoise", "a.ply", "-o", "b.ply", "--patch_size", "99999"], "from 1 to 32767 (got 99999)"),
        (["denoise", "a.ply", "-o", "b.ply", "--strength", "half"], "'strength' to be a number (got half)"),
        (["denoise", "", "-o", "b.ply"], "Expected no empty words (got '')"),
        (["denoize"], "Expected a command (got 'denoize'). Did you mean `dnf-pyg denoise`?"),
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
