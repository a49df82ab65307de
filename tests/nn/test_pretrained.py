import hashlib
import json
import shutil

import pytest
import torch

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
from dnf_pyg.nn.pretrained import packaged_weights

SMALL = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8}


@pytest.fixture
def folder(tmp_path):
    net = DNFNet(**SMALL).float()
    net.noise_range = (0.1, 0.3)
    net.save_pretrained(tmp_path / "net")
    return tmp_path / "net"


def test_round_trip(folder):
    net = DNFNet.from_pretrained(folder)
    assert net.noise_range == (0.1, 0.3)
    assert json.loads((folder / "config.json").read_text())["network"] == "DNFNet"
    assert not net.training


def test_another_class_is_named(folder):
    with pytest.raises(WeightsError, match=r"a DNFNet\)\. Call `DNFNet.from_pretrained`"):
        SurfaceDNFNet.from_pretrained(folder)


def test_packaged_weights_come_before_any_network(monkeypatch):
    monkeypatch.setattr("huggingface_hub.snapshot_download", lambda *a, **k: pytest.fail("asked the hub"))
    assert SurfaceDNFNet.from_pretrained("single").noise_range == (0.0, 0.5)
    assert set(packaged_weights()) == {"best", "single", "small", "synthetic"}


def test_hub(folder, tmp_path, monkeypatch):
    def snapshot_download(repo_id, allow_patterns, revision=None):
        assert (repo_id, revision) == ("user/net", "v1")
        return shutil.copytree(folder, tmp_path / "cache")

    monkeypatch.setattr("huggingface_hub.snapshot_download", snapshot_download)
    net = DNFNet.from_pretrained("user/net", revision="v1")
    torch.testing.assert_close(net.state_dict(), DNFNet.from_pretrained(folder).state_dict(), rtol=0, atol=0)


def test_hub_that_cannot_be_reached(monkeypatch):
    def snapshot_download(*args, **options):
        raise OSError("no connection\nmore")

    monkeypatch.setattr("huggingface_hub.snapshot_download", snapshot_download)
    with pytest.raises(WeightsError, match=r"'user/net': no connection\)\. Check its name"):
        DNFNet.from_pretrained("user/net")


def test_push(folder, monkeypatch):
    calls = []

    class Api:
        def create_repo(self, repo_id, exist_ok):
            calls.append(repo_id)

        def upload_folder(self, repo_id, folder_path, **options):
            calls.append((repo_id, folder_path, options))

    monkeypatch.setattr("huggingface_hub.HfApi", Api)
    DNFNet.from_pretrained(folder).push_to_hub("user/net", folder, commit_message="new")
    assert calls == ["user/net", ("user/net", str(folder), {"commit_message": "new"})]


def test_folder_that_cannot_be_written(folder, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(WeightsError, match="Expected a folder that can be written"):
        DNFNet.from_pretrained(folder).save_pretrained(tmp_path / "file")


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
def test_damaged_files(folder, name):
    (folder / name).write_bytes((folder / name).read_bytes()[:-20])
    with pytest.raises(WeightsError, match="Expected readable weights"):
        DNFNet.from_pretrained(folder)


def test_released_weights_are_compared_with_their_checksum(folder):
    digest = hashlib.sha256((folder / "model.safetensors").read_bytes()).hexdigest()
    (folder / "metrics.json").write_text(json.dumps({"sha256": digest}))
    net = DNFNet.from_pretrained(folder)
    with torch.no_grad():
        net.heads[0].lins[0].weight[0, 0] += 1
    net.save_pretrained(folder)
    with pytest.raises(WeightsError, match=rf"the sha256 of their release, {digest} \(got "):
        DNFNet.from_pretrained(folder)
