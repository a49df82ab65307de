import json

import pytest
import torch

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet
from dnf_pyg.weights.load import load_cascade, load_network, packaged_weights
from dnf_pyg.weights.release import fingerprint, read_release, write_release

SMALL = {"k": (3, 5, 8), "residual_k": 4, "channels": (8, 8, 8), "embedding_channels": 8}
BENCHMARK = {
    "data": "set/test",
    "num_meshes": 2,
    "parameters": "denoise(weights=0123)",
    "theta_deg": 1.25,
    "theta_normals_deg": 1.5,
    "vertex_error": 0.05,
    "theta_by_mesh": {"box": 1.25},
}


@pytest.fixture
def net():
    torch.manual_seed(0)
    return DNFNet(**SMALL).eval()


def release(folder, net, **changes):
    text = {"description": "For boxes.\nAnd balls.", "licence": "MIT", "sources": "Boxes, CC0.", "recipe": "fit -c box"}
    return write_release(folder, net, **{**text, **changes})


def test_released_folder_says_what_it_is(net, tmp_path):
    written = release(tmp_path / "boxes", net, benchmark=BENCHMARK)
    assert written == read_release(tmp_path / "boxes")
    assert (written.name, written.description, written.licence) == ("boxes", "For boxes. And balls.", "mit")
    assert written.intact
    assert written.metrics["benchmark"] == BENCHMARK
    assert written.metrics["num_parameters"] == sum(p.numel() for p in net.parameters())
    card = (tmp_path / "boxes" / "README.md").read_text()
    for text in ("Boxes, CC0.", "fit -c box", "| 1.250 | 1.500 | 0.0500 |", "| box | 1.250 |", 'weights="boxes"'):
        assert text in card
    assert written.metrics["sha256"] in card


def test_released_weights_load_as_the_same_network(net, tmp_path):
    release(tmp_path / "boxes", net)
    loaded = load_network(tmp_path / "boxes")
    assert fingerprint(loaded) == fingerprint(net) == read_release(tmp_path / "boxes").metrics["fingerprint"]


def test_noise_levels_of_the_training_travel_with_the_weights(net, tmp_path):
    release(tmp_path / "boxes", net)
    assert load_network(tmp_path / "boxes").noise_range is None
    net.noise_range = (0.1, 0.3)
    release(tmp_path / "boxes", net)
    assert load_network(tmp_path / "boxes").noise_range == (0.1, 0.3)
    assert fingerprint(net) == fingerprint(load_network(tmp_path / "boxes"))
    config = json.loads((tmp_path / "boxes" / "config.json").read_text())
    (tmp_path / "boxes" / "config.json").write_text(json.dumps({**config, "noise_range": "strong"}))
    with pytest.raises(WeightsError, match="boxes"):
        load_network(tmp_path / "boxes")


def test_fingerprint_changes_with_weights_and_with_configuration(net):
    before = fingerprint(net)
    torch.manual_seed(0)
    assert fingerprint(DNFNet(**SMALL)) == before
    assert fingerprint(DNFNet(**{**SMALL, "residual_k": 3})) != before
    with torch.no_grad():
        next(net.parameters()).view(-1)[0] += 1e-3
    assert fingerprint(net) != before


def test_other_weights_than_those_of_the_card_are_noticed(net, tmp_path):
    release(tmp_path / "boxes", net)
    file = tmp_path / "boxes" / "model.safetensors"
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(bytes(data))
    assert not read_release(tmp_path / "boxes").intact


@pytest.mark.parametrize("name", ["README.md", "metrics.json", "model.safetensors"])
def test_a_missing_file(net, tmp_path, name):
    release(tmp_path / "boxes", net)
    (tmp_path / "boxes" / name).unlink()
    with pytest.raises(WeightsError, match="boxes"):
        read_release(tmp_path / "boxes")


def test_damaged_metrics(net, tmp_path):
    release(tmp_path / "boxes", net)
    (tmp_path / "boxes" / "metrics.json").write_text("{")
    with pytest.raises(WeightsError, match="Export them again"):
        read_release(tmp_path / "boxes")


def test_a_folder_that_cannot_be_written(net, tmp_path):
    (tmp_path / "boxes").write_text("a file")
    with pytest.raises(WeightsError, match="can be written"):
        release(tmp_path / "boxes", net)


@pytest.mark.parametrize("name", packaged_weights())
def test_packaged_weights_are_complete(name):
    folder = packaged_weights()[name]
    packaged = read_release(folder)
    assert packaged.intact
    assert packaged.metrics["fingerprint"] == fingerprint(load_cascade(name))
    assert json.dumps(packaged.metrics["benchmark"]) != "null"
    assert (folder / "model.safetensors").stat().st_size < 3_000_000
    assert not any(path.suffix in (".pkl", ".pt", ".pth", ".bin", ".ckpt") for path in folder.iterdir())
