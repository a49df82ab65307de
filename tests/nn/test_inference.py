import pytest
import torch
from torch_geometric.data import Data

from dnf_pyg.nn.inference import evaluation_network, inference_device, sparser_edges, uses_bf16


def test_network_that_is_ready_is_used_as_it_is():
    net = torch.nn.Sequential(torch.nn.Linear(2, 2), torch.nn.BatchNorm1d(2)).eval()
    assert evaluation_network(net, torch.device("cpu")) is net


@pytest.mark.parametrize("device", ["cpu", "meta"])
def test_other_networks_are_copied(device):
    net = torch.nn.Sequential(torch.nn.Linear(2, 2), torch.nn.BatchNorm1d(2)).double()
    net[0].eval()
    ready = evaluation_network(net, torch.device(device))
    assert ready is not net
    assert not any(module.training for module in ready.modules())
    assert {value.device.type for value in ready.state_dict().values()} == {device}
    assert ready[0].weight.dtype == torch.float64
    assert [net.training, net[0].training, net[1].training] == [True, False, True]
    assert {value.device.type for value in net.state_dict().values()} == {"cpu"}


def test_edges_of_each_level_are_those_of_evenly_spaced_ranks():
    ranks = torch.arange(5).repeat(2)
    data = Data(edge_index=torch.stack([torch.arange(10), torch.arange(2).repeat_interleave(5)]), edge_attr=ranks)
    assert sparser_edges(data, (3, 5), None) is None
    first, second, third = sparser_edges(data, (2, 3, 5), (9, 2, 3))  # no more than the network has
    assert first[0].tolist() == [0, 1, 5, 6]
    assert second[0].tolist() == [0, 2, 5, 7]
    assert third[0].tolist() == [0, 2, 4, 5, 7, 9]


@pytest.mark.parametrize("available", [False, True])
def test_automatic_device_is_a_gpu_where_there_is_one(monkeypatch, available):
    monkeypatch.setattr("torch.cuda.is_available", lambda: available)
    assert inference_device("auto") == torch.device("cuda" if available else "cpu")
    assert inference_device("mps") == torch.device("mps")


@pytest.mark.parametrize(("amx", "avx512"), [(False, False), (True, False), (False, True)])
def test_automatic_precision_asks_the_processor(monkeypatch, amx, avx512):
    monkeypatch.setattr("torch.cpu._is_amx_tile_supported", lambda: amx)
    monkeypatch.setattr("torch.cpu._is_avx512_bf16_supported", lambda: avx512)
    assert uses_bf16("auto", torch.device("cpu")) == (amx or avx512)
    assert not uses_bf16("auto", torch.device("cuda"))
    assert [uses_bf16(precision, torch.device("cpu")) for precision in ("fp32", "bf16")] == [False, True]
