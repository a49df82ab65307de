import pytest
import torch
from torch.utils.data import Dataset

from dnf_pyg.datamodules import sampling
from dnf_pyg.datamodules.sampling import EpochSampler, SeededItems


def drawn(epoch, done=0, batch_size=2, seed=0):
    return list(EpochSampler(range(7), seed, lambda: (epoch, done), batch_size))


def test_order_follows_seed_and_epoch():
    assert drawn(3) == drawn(3)
    assert {epoch for epoch, _ in drawn(3)} == {3}
    orders = [[item for _, item in drawn(epoch, seed=seed)] for epoch, seed in ((3, 0), (4, 0), (3, 9))]
    assert all(sorted(order) == list(range(7)) for order in orders)
    assert len({tuple(order) for order in orders}) == 3


def test_a_resumed_epoch_leaves_out_what_was_done_once():
    progress = [(5, 2)]
    sampler = EpochSampler(range(7), 0, lambda: progress[0], batch_size=2)
    assert list(sampler) == drawn(5)[4:]
    progress[0] = (6, 0)
    assert list(sampler) == drawn(6)


def test_processes_share_the_order_of_one(monkeypatch):
    whole, shares = drawn(2), []
    for rank in range(2):
        monkeypatch.setattr(sampling, "_processes", lambda rank=rank: (2, rank))
        shares.append(drawn(2))
    together = [place for pair in zip(*shares, strict=True) for place in pair]
    assert together == [*whole, whole[0]]  # as many for each process: an odd order begins again


class Noise(Dataset):
    def __len__(self):
        return 4

    def __getitem__(self, item):
        return torch.rand(3)


@pytest.mark.parametrize("other", [(1, 3), (2, 2)], ids=["item", "epoch"])
def test_items_follow_seed_epoch_and_item_alone(other):
    items = SeededItems(Noise(), seed=0)
    torch.manual_seed(1)
    first, state = items[1, 2], torch.get_rng_state()
    torch.rand(5)
    torch.testing.assert_close(items[1, 2], first, rtol=0, atol=0)
    assert not torch.equal(items[other], first)
    assert not torch.equal(SeededItems(Noise(), seed=1)[1, 2], first)
    torch.manual_seed(1)
    assert torch.equal(torch.get_rng_state(), state)  # the numbers of the training are not touched
    assert len(items) == 4
