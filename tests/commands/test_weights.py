import json

import pytest
import torch

from dnf_pyg.cli import main
from dnf_pyg.nn import DNFNet, pretrained
from dnf_pyg.nn.config import describe_network
from dnf_pyg.weights import load_network, release
from dnf_pyg.weights.release import fingerprint

TEXTS = {"sources.md": "Boxes made in code, CC0.\n", "recipe.yaml": "trainer:\n  max_epochs: 1\n"}


@pytest.fixture
def net():
    torch.manual_seed(0)
    return DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8).eval()


@pytest.fixture
def checkpoint(net, tmp_path):
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": describe_network(net), "state_dict": state}, tmp_path / "net.ckpt")
    for name, text in TEXTS.items():
        (tmp_path / name).write_text(text)
    return tmp_path / "net.ckpt"


@pytest.fixture
def packaged(tmp_path, monkeypatch):
    """An empty folder of packaged weights in place of the real one."""
    folder = tmp_path / "weights"
    folder.mkdir()
    monkeypatch.setattr(pretrained, "_PACKAGED", folder)
    monkeypatch.setattr(release, "_FOLDER", folder)
    return folder


def results(path, weights):
    row = {"mesh": "box", "noise": "n1", "method": "m", "theta_deg": 1.25, "vertex_error": 0.1, "seconds": 2.0}
    row |= {"theta_normals_deg": 1.5, "parameters": f"denoise(weights={weights}, num_iterations=20, repeat=1, seed=0)"}
    path.write_text(json.dumps({"data": "set/test", "rows": [row]}))
    return path


def export(checkpoint, output, *words):
    texts = ["--sources", checkpoint.with_name("sources.md"), "--recipe", checkpoint.with_name("recipe.yaml")]
    words = ["weights", "export", checkpoint, "-o", output, "--description", "For boxes.", *texts, *words]
    return main([str(word) for word in words])


def test_exported_weights_are_listed_with_their_metrics(net, checkpoint, packaged, tmp_path, capsys):
    benchmark = results(tmp_path / "results.json", fingerprint(net))
    assert export(checkpoint, packaged / "boxes", "--benchmark", benchmark, "--licence", "CC0-1.0") == 0
    capsys.readouterr()
    assert main(["weights"]) == 0
    name, description, facts = capsys.readouterr().out.splitlines()
    assert name == "boxes"
    assert description.strip() == "For boxes."
    assert "theta 1.250 degrees on set/test" in facts
    assert "licence cc0-1.0" in facts
    assert facts.endswith("verified")
    card = (packaged / "boxes" / "README.md").read_text()
    assert TEXTS["sources.md"] in card
    assert f"```yaml\n{TEXTS['recipe.yaml']}```" in card
    assert fingerprint(load_network("boxes")) == fingerprint(net)


def test_damaged_weights_are_named(checkpoint, packaged, capsys):
    export(checkpoint, packaged / "boxes")
    with (packaged / "boxes" / "model.safetensors").open("ab") as file:
        file.write(b" ")
    assert main(["weights"]) == 2
    captured = capsys.readouterr()
    assert "WRONG" in captured.out
    assert "got others: boxes" in captured.err


def test_no_weights(packaged, capsys):
    assert main(["weights"]) == 0
    assert "There are no weights in this build." in capsys.readouterr().out


def test_results_of_other_weights_are_refused(checkpoint, packaged, tmp_path, capsys):
    benchmark = results(tmp_path / "results.json", "0" * 12)
    assert export(checkpoint, packaged / "boxes", "--benchmark", benchmark) == 2
    assert "Benchmark them first." in capsys.readouterr().err
    assert not (packaged / "boxes").exists()


def test_files_that_are_not_what_they_should_be(checkpoint, packaged, tmp_path, capsys):
    assert export(checkpoint, packaged / "boxes", "--benchmark", checkpoint.with_name("sources.md")) == 2
    assert "results.json" in capsys.readouterr().err
    checkpoint.with_name("sources.md").unlink()
    assert export(checkpoint, packaged / "boxes") == 2
    assert "text file" in capsys.readouterr().err
