import pytest
import torch

from dnf_pyg.train.settings import PartSettings, Thinning


@pytest.mark.parametrize(("num_steps", "steps"), [(None, [0, 1, 2, 3]), (2, [0, 1]), (0, [])])
def test_applies_until_its_last_step(num_steps, steps):
    assert [step for step in range(4) if Thinning([1], num_steps).applies(step)] == steps


def test_chooses_ranks_of_each_level_whatever_the_order_of_edges():
    edge_index = torch.stack([torch.arange(12), torch.arange(2).repeat_interleave(6)])
    rank = torch.arange(6).repeat(2)
    order = torch.randperm(12, generator=torch.Generator().manual_seed(0))
    for edges, ranks in ((edge_index, rank), (edge_index[:, order], rank[order])):
        near, far = Thinning([2, 9]).choose(edges, ranks, k=(3, 6))
        assert sorted(far[0].tolist()) == list(range(12))  # no more than there are
        first, second = (near[0][near[1] == center].sort().values - 6 * center for center in (0, 1))
        assert torch.equal(first, second)
        assert first[0] == 0
        assert first[1] < 3


def test_parts_use_the_network_as_it_is():
    assert PartSettings() == PartSettings(k=None, weight=1.0)
