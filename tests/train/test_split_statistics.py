import copy

import pytest
import torch

from dnf_pyg.train.split_statistics import SplitStatistics

NAMES = ["one", "two"]


@pytest.fixture
def net():
    torch.manual_seed(0)
    return torch.nn.Sequential(torch.nn.Linear(3, 4), torch.nn.BatchNorm1d(4), torch.nn.Linear(4, 2))


def batches():
    """Data sets in turn, with means far apart."""
    generator = torch.Generator().manual_seed(0)
    for turn in range(6):
        name = NAMES[turn % 2]
        yield name, torch.randn(8, 3, generator=generator) + 5 * NAMES.index(name)


def test_each_data_set_has_the_statistics_of_its_own_batches(net):
    alone = {name: copy.deepcopy(net) for name in NAMES}
    split = SplitStatistics(net, NAMES)
    for name, batch in batches():
        with split.use(name):
            torch.testing.assert_close(net(batch), alone[name](batch))
    for name in NAMES:
        with split.use(name):
            for key in ("running_mean", "running_var", "num_batches_tracked"):
                torch.testing.assert_close(getattr(net[1], key), getattr(alone[name][1], key))
    assert alone["one"][1].running_mean.sub(alone["two"][1].running_mean).abs().max() > 0.1


def test_the_network_holds_those_used_last(net):
    split = SplitStatistics(net, NAMES)
    buffer = net[1].running_mean
    for name, batch in batches():
        with split.use(name):
            net(batch)
            used = net[1].running_mean.clone()
    assert net[1].running_mean is buffer  # whoever watches the buffers of the network sees them change
    torch.testing.assert_close(buffer, used)


def test_statistics_are_saved_and_loaded(net):
    split = SplitStatistics(net, NAMES)
    for name, batch in batches():
        with split.use(name):
            net(batch)
    other = SplitStatistics(copy.deepcopy(net), NAMES)
    other.load_state_dict(split.state_dict())
    with split.use("one"), other.use("one"):
        torch.testing.assert_close(other._norms[0].running_mean, net[1].running_mean)


def test_unknown_data_set(net):
    with (
        pytest.raises(ValueError, match=r"one of \['one', 'two'\] \(got 'three'\)"),
        SplitStatistics(net, NAMES).use("three"),
    ):
        pass
