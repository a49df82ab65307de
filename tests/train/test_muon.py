import copy

import pytest
import torch
from lightning.pytorch.cli import LightningArgumentParser
from torch.optim import AdamW, Muon
from torch.optim.lr_scheduler import StepLR

from dnf_pyg.train.module import NormalFilteringModule
from dnf_pyg.train.muon import MuonAdamW

OPTIONS = {"lr": 3e-2, "weight_decay": 1e-2}


@pytest.fixture
def net():
    torch.manual_seed(0)
    return torch.nn.Sequential(torch.nn.Linear(4, 6), torch.nn.BatchNorm1d(6), torch.nn.ReLU(), torch.nn.Linear(6, 3))


def by_hand(net):
    matrices = [value for value in net.parameters() if value.ndim == 2]
    others = [value for value in net.parameters() if value.ndim != 2]
    muon = Muon(matrices, momentum=0.9, adjust_lr_fn="match_rms_adamw", **OPTIONS)
    return [muon, AdamW(others, **OPTIONS)]


def descend(net, optimizers, steps, schedules=()):
    for step in steps:
        x = torch.randn(8, 4, generator=torch.Generator().manual_seed(step))
        for optimizer in optimizers:
            optimizer.zero_grad()
        net(x).square().mean().backward()
        for one in (*optimizers, *schedules):
            one.step()


def assert_equal(net, other):
    torch.testing.assert_close(dict(net.state_dict()), dict(other.state_dict()), rtol=0, atol=0)


def test_equals_both_optimizers_side_by_side(net):
    other = copy.deepcopy(net)
    one, two = MuonAdamW(net.parameters(), momentum=0.9, **OPTIONS), by_hand(other)
    descend(net, [one], range(5), [StepLR(one, 2, 0.5)])
    descend(other, two, range(5), [StepLR(optimizer, 2, 0.5) for optimizer in two])
    assert_equal(net, other)


@pytest.mark.parametrize("stored", [False, True])
def test_goes_on_exactly_from_its_state(net, stored, tmp_path):
    whole = copy.deepcopy(net)
    optimizer = MuonAdamW(whole.parameters(), **OPTIONS)
    schedule = StepLR(optimizer, 2, 0.5)
    descend(whole, [optimizer], range(3), [schedule])
    state = {"net": whole.state_dict(), "optimizer": optimizer.state_dict(), "schedule": schedule.state_dict()}
    if stored:
        torch.save(state, tmp_path / "state.pt")
        state = torch.load(tmp_path / "state.pt", weights_only=True)
    state = copy.deepcopy(state)
    net.load_state_dict(state["net"])
    again = MuonAdamW(net.parameters(), lr=1.0)  # the rate comes from the state
    again_schedule = StepLR(again, 2, 0.5)
    again.load_state_dict(state["optimizer"])
    again_schedule.load_state_dict(state["schedule"])
    descend(net, [again], range(3, 6), [again_schedule])
    descend(whole, [optimizer], range(3, 6), [schedule])
    assert_equal(net, whole)


@pytest.mark.parametrize("kind", ["weight", "bias"])
def test_parameters_of_one_kind_alone(kind):
    lin = torch.nn.Linear(3, 2)
    before = getattr(lin, kind).detach().clone()
    optimizer = MuonAdamW([getattr(lin, kind)], lr=0.1)
    assert len(optimizer.param_groups) == 1
    lin(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    assert not torch.equal(getattr(lin, kind), before)


def test_closure(net):
    optimizer = MuonAdamW(net.parameters())

    def closure():
        optimizer.zero_grad()
        loss = net(torch.ones(4, 4)).square().mean() + 1
        loss.backward()
        return loss

    assert float(optimizer.step(closure)) >= 1


def test_is_made_from_a_config_with_its_schedule():
    parser = LightningArgumentParser()
    parser.add_lightning_class_args(NormalFilteringModule, "model")
    words = ["net=dnf_pyg.nn.DNFNet", "net.channels=[8,8,8]", "optimizer=dnf_pyg.train.muon.MuonAdamW"]
    words += ["optimizer.lr=0.02", "scheduler=dnf_pyg.train.schedule.WarmupStableDecay", "scheduler.warmup_steps=4"]
    module = parser.instantiate_classes(parser.parse_args([f"--model.{word}" for word in words])).model
    made = module.configure_optimizers()
    assert isinstance(made["optimizer"], MuonAdamW)
    assert [group["lr"] for group in made["optimizer"].param_groups] == pytest.approx([0.005, 0.005])
    count = sum(len(group["params"]) for group in made["optimizer"].param_groups)
    assert count == len(list(module.net.parameters()))
