import json
import pickle
import shutil

import huggingface_hub
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torch_geometric.data import Data

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
from dnf_pyg.nn.config import describe_network
from dnf_pyg.weights.load import load_cascade, load_network, packaged_weights

SMALL = {"k": (3, 5, 8), "residual_k": 4, "channels": (8, 8, 8), "embedding_channels": 8}


@pytest.fixture
def net():
    torch.manual_seed(0)
    return DNFNet(**SMALL).eval()


@pytest.fixture
def checkpoint(net, tmp_path):
    path = tmp_path / "net.ckpt"
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": describe_network(net), "state_dict": state}, path)
    return path


def assert_same(first, second):
    assert describe_network(first) == describe_network(second)
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
    torch.save(
        {**content, "datamodule_hyper_parameters": {"noise_level": {"a": [0.1, 0.3], "b": "strong"}}}, checkpoint
    )
    with pytest.raises(WeightsError, match="'noise_range' as"):
        load_network(checkpoint)


def test_packaged_weights_tell_the_noise_levels_of_their_training():
    known = {"best": (0.0, 0.5), "single": (0.0, 0.5), "small": (0.0, 0.5), "synthetic": (0.1, 0.3)}
    assert {name: load_cascade(name).noise_range for name in packaged_weights()} == known


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
    other = describe_network(DNFNet(**{**SMALL, "channels": (4, 8, 8)}))
    torch.save({"network": other, "state_dict": state}, tmp_path / "net.ckpt")
    with pytest.raises(WeightsError, match=r"tensor '.*' of shape .*net\.ckpt"):
        load_network(tmp_path / "net.ckpt")


@pytest.mark.parametrize("name", ["single", "small", "synthetic"])
def test_folders_and_checkpoints_of_version_1_give_the_same_normals(name, tmp_path):
    net = load_network(name)
    flags = {"align": False, "bilateral_iterations": 0, "surface": False}
    if isinstance(net, SurfaceDNFNet):
        flags = {"align": True, "surface": True, "subtract": True}
    old = {**net.arguments, **flags}
    (tmp_path / "old").mkdir()
    shutil.copy(packaged_weights()[name] / "model.safetensors", tmp_path / "old")
    (tmp_path / "old" / "config.json").write_text(json.dumps(old))
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": old, "state_dict": state}, tmp_path / "old.ckpt")
    generator = torch.Generator().manual_seed(0)
    x = torch.nn.functional.normalize(torch.randn(120, 3, generator=generator), dim=1)
    near = torch.rand(120, 120, generator=generator).fill_diagonal_(-1).argsort(dim=1)[:, : max(net.k)]
    edge_index = torch.stack([near.flatten(), torch.arange(120).repeat_interleave(max(net.k))])
    patch = Data(x=x, pos=torch.randn(120, 3, generator=generator), area=torch.rand(120, generator=generator) + 0.1)
    patch.update({"edge_index": edge_index, "edge_attr": torch.arange(max(net.k)).repeat(120)})
    with torch.no_grad():
        expected = net(**net.gather(patch))
        for path in ("old", "old.ckpt"):
            again = load_network(tmp_path / path)
            assert torch.equal(again(**again.gather(patch)), expected)


def test_hub_is_only_asked_with_its_prefix(net, tmp_path, monkeypatch):
    net.save_pretrained(tmp_path / "folder")
    asked = []

    def download(repo_id, **options):
        asked.append(repo_id)
        return str(tmp_path / "folder")

    monkeypatch.setattr(huggingface_hub, "snapshot_download", download)
    monkeypatch.chdir(tmp_path)
    for misspelt in ("user/net", "bestt", "folderr/net"):
        with pytest.raises(WeightsError, match=rf"or hf://user/name \(got '{misspelt}'\)\. Check the name"):
            load_network(misspelt)
    assert not asked
    assert_same(net, load_network("hf://user/net"))
    assert asked == ["user/net"]


def test_data_set_of_weights_that_keep_none_apart(net, checkpoint, tmp_path):
    net.save_pretrained(tmp_path / "folder")
    for path in (checkpoint, tmp_path / "folder"):
        with pytest.raises(WeightsError, match="data_set"):
            load_network(path, data_set="kinect")


def loaded_or_refused(path):
    """The network, or ``None`` after an error that names the file; any other error fails the test."""
    try:
        return load_network(path)
    except WeightsError as error:
        if path.name not in str(error):
            raise AssertionError(f"no file in: {error}") from error
    return None


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 2**40) | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=4,
)
PLACES = [
    ("network",), ("network", "version"), ("network", "network"), ("network", "arguments"), ("network", "noise_range"),
    ("network", "random_rotation"),
    ("network", "arguments", "k"), ("network", "arguments", "num_units"), ("network", "arguments", "channels"),
    ("network", "arguments", "embedding_channels"), ("network", "arguments", "subtract"), ("network", "new"),
    ("state_dict",), ("state_dict", "net.heads.0.lins.0.weight"), ("state_dict", "net.new"), ("state_dict", 7),
    ("statistics",), ("statistics", "names"), ("statistics", "tensors"), ("datamodule_hyper_parameters",),
    ("datamodule_hyper_parameters", "noise_level"),
]  # fmt: skip


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.sampled_from(PLACES), value=VALUES)
def test_any_changed_checkpoint_is_refused_or_is_the_same_network(net, tmp_path, place, value):
    state = {f"net.{key}": tensor for key, tensor in net.state_dict().items()}
    content = {"network": describe_network(net), "state_dict": state, "datamodule_hyper_parameters": {}}
    content["statistics"] = {"names": [], "tensors": []}
    target = content
    for key in place[:-1]:
        target = target[key]
    target[place[-1]] = value
    torch.save(content, tmp_path / "changed.ckpt")
    loaded = loaded_or_refused(tmp_path / "changed.ckpt")
    if loaded is not None:
        assert set(loaded.state_dict()) == set(net.state_dict())
        assert all(torch.equal(tensor, net.state_dict()[key]) for key, tensor in loaded.state_dict().items())


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_damaged_file_is_refused_or_is_a_network(net, tmp_path, data):
    """Bytes of the header, of the config or anywhere else are changed, or the file ends early."""
    net.save_pretrained(tmp_path / "folder")
    file = tmp_path / "folder" / data.draw(st.sampled_from(["model.safetensors", "config.json"]))
    content = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(len(content) - 1, 4000)))] = data.draw(st.integers(0, 255))
    file.write_bytes(content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))])
    loaded = loaded_or_refused(tmp_path / "folder")
    if loaded is not None:
        assert all(tensor.isfinite().all() for tensor in loaded.state_dict().values())
