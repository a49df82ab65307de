import pickle

import pytest
import torch

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet
from dnf_pyg.weights.load import load_network, packaged_weights

SMALL = {"k": (3, 5, 8), "residual_k": 4, "channels": (8, 8, 8), "embedding_channels": 8}


@pytest.fixture
def net():
    torch.manual_seed(0)
    return DNFNet(**SMALL).eval()


@pytest.fixture
def checkpoint(net, tmp_path):
    path = tmp_path / "net.ckpt"
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": net.config, "state_dict": state}, path)
    return path


def assert_same(first, second):
    assert first.config == second.config
    for key, value in first.state_dict().items():
        torch.testing.assert_close(second.state_dict()[key], value)


def test_checkpoint_round_trip(net, checkpoint):
    loaded = load_network(checkpoint)
    assert not loaded.training
    assert_same(net, loaded)


def test_checkpoint_tells_the_noise_levels_of_its_data(checkpoint):
    assert load_network(checkpoint).noise_range is None
    content = torch.load(checkpoint, weights_only=True)
    torch.save({**content, "datamodule_hyper_parameters": {"noise_level": [0.1, 0.3]}}, checkpoint)
    assert load_network(checkpoint).noise_range == (0.1, 0.3)


def test_packaged_weights_tell_the_noise_levels_of_their_training():
    known = {"best": (0.03, 0.5), "synthetic": (0.1, 0.3)}
    assert {name: load_network(name).noise_range for name in packaged_weights()} == known


def test_folder_round_trip(net, tmp_path):
    net.save_pretrained(tmp_path / "folder")
    assert_same(net, load_network(tmp_path / "folder"))


def test_folder_without_weights(tmp_path):
    with pytest.raises(WeightsError, match=r"without config.json, model.safetensors"):
        load_network(tmp_path)


def test_truncated_checkpoint(checkpoint):
    checkpoint.write_bytes(checkpoint.read_bytes()[:-2000])
    with pytest.raises(WeightsError, match=r"net\.ckpt"):
        load_network(checkpoint)


def test_truncated_safetensors(net, tmp_path):
    net.save_pretrained(tmp_path / "folder")
    file = tmp_path / "folder" / "model.safetensors"
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(WeightsError, match="folder"):
        load_network(tmp_path / "folder")


class Malicious:
    def __reduce__(self):
        return (exec, ("raise SystemExit('ran')",))


@pytest.mark.parametrize("write", [torch.save, lambda obj, path: path.write_bytes(pickle.dumps(obj))])
def test_code_in_a_pickle_is_never_run(tmp_path, write):
    path = tmp_path / "bad.ckpt"
    write({"state_dict": Malicious()}, path)
    with pytest.raises(WeightsError, match=r"bad\.ckpt"):
        load_network(path)


def test_checkpoint_of_something_else(tmp_path):
    torch.save({"state_dict": {}}, tmp_path / "other.ckpt")
    with pytest.raises(WeightsError, match="without key 'network'"):
        load_network(tmp_path / "other.ckpt")


def test_checkpoint_of_another_architecture(net, tmp_path):
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": {**net.config, "channels": [4, 8, 8]}, "state_dict": state}, tmp_path / "net.ckpt")
    with pytest.raises(WeightsError, match="Expected weights of a DNFNet"):
        load_network(tmp_path / "net.ckpt")
