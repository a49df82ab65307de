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
    schedules = [StepLR(optimizer, 2, 0.5) for optimizer in (one, *two)]
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        for param, same in zip(net.parameters(), other.parameters(), strict=True):
            param.grad = torch.randn(param.shape, generator=generator)
            same.grad = param.grad.clone()
        for part in (one, *two, *schedules):
            part.step()
    for param, same in zip(net.parameters(), other.parameters(), strict=True):
        rounding = 0.01 if param.ndim == 2 else 0.0  # torch's Muon rounds to bfloat16
        torch.testing.assert_close(param, same, rtol=rounding, atol=rounding * OPTIONS["lr"])


@pytest.mark.parametrize("shape", [(3, 5), (5, 3), (4, 4)])
def test_moves_a_matrix_by_its_orthogonal_factor(shape):
    generator = torch.Generator().manual_seed(0)
    left, _, right = torch.linalg.svd(torch.randn(shape, generator=generator, dtype=torch.double))
    size = min(shape)
    values = torch.linspace(0.3, 1, size, dtype=torch.double)
    grad = left[:, :size] * values @ right[:size]
    param = torch.nn.Parameter(torch.ones_like(grad))
    param.grad = grad.clone()
    MuonAdamW([param], lr=0.1, weight_decay=0.5, momentum=0.0).step()
    at = values / values.norm()
    for _ in range(5):
        at = 3.4445 * at - 4.775 * at**3 + 2.0315 * at**5  # the polynomial acts on the singular values alone
    assert at.min() > 0.6
    assert at.max() < 1.3
    moved = left[:, :size] * at @ right[:size] * (0.2 * max(shape) ** 0.5 * 0.1)
    torch.testing.assert_close(param.detach(), torch.full(shape, 0.95, dtype=torch.double) - moved)


def test_parameters_without_gradient_stay(net):
    before = copy.deepcopy(net)
    MuonAdamW(net.parameters(), **OPTIONS).step()
    assert_equal(net, before)


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
