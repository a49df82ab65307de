import json

import pytest
import torch

from dnf_pyg.errors import WeightsError
from dnf_pyg.nn import Cascade, DNFNet, SurfaceDNFNet
from dnf_pyg.weights.load import load_cascade, load_network
from dnf_pyg.weights.release import fingerprint

SMALL = {"k": (3, 5), "residual_k": 4, "channels": (8, 8), "embedding_channels": 8}


@pytest.fixture
def cascade():
    return Cascade([SurfaceDNFNet(**SMALL), SurfaceDNFNet(**SMALL, num_earlier=2)]).eval()


def test_round_trip_through_one_folder(cascade, tmp_path):
    cascade.networks[0].noise_range = (0.1, 0.3)
    cascade.save_pretrained(tmp_path / "two")
    for again in (Cascade.from_pretrained(tmp_path / "two"), load_cascade(tmp_path / "two")):
        assert [net.arguments for net in again.networks] == [net.arguments for net in cascade.networks]
        assert again.noise_range == (0.1, 0.3)
        assert not again.training
        assert fingerprint(again) == fingerprint(cascade)
        for name, value in cascade.state_dict().items():
            assert torch.equal(again.state_dict()[name], value)


def test_a_single_network_is_a_cascade_of_one(tmp_path):
    net = DNFNet(**SMALL).eval()
    Cascade([net]).save_pretrained(tmp_path / "one")
    assert net.networks == [net]
    assert fingerprint(load_cascade(tmp_path / "one")) == fingerprint(net)
    assert type(load_network(tmp_path / "one")) is DNFNet


def test_several_networks_are_no_network(cascade, tmp_path):
    cascade.save_pretrained(tmp_path / "two")
    with pytest.raises(WeightsError, match=r"a cascade of 2.*Cascade.from_pretrained"):
        load_network(tmp_path / "two")
    with pytest.raises(WeightsError, match=r"a Cascade.*Call `Cascade.from_pretrained`"):
        SurfaceDNFNet.from_pretrained(tmp_path / "two")
    with pytest.raises(ValueError, match="at least one network"):
        Cascade([])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 1}, "'version' 2 and 'cascade' only"),
        ({"noise_range": [0, 1]}, "'version' 2 and 'cascade' only"),
        ({"cascade": []}, "'cascade' as a list of 1 to 16 networks"),
        ({"cascade": "DNFNet"}, "'cascade' as a list of 1 to 16 networks"),
        ({"cascade": [None]}, "tensors of the networks of the cascade"),
        ({"cascade": [None, None]}, "a description of a network"),
    ],
)
def test_refuses_other_descriptions(cascade, tmp_path, change, message):
    cascade.save_pretrained(tmp_path)
    config = json.loads((tmp_path / "config.json").read_text())
    (tmp_path / "config.json").write_text(json.dumps({**config, **change}))
    with pytest.raises(WeightsError, match=message):
        load_cascade(tmp_path)
