import pytest
import torch

from dnf_pyg.train.schedule import WarmupStableDecay


def make(lr=2.0, **settings):
    optimizer = torch.optim.SGD([torch.nn.Parameter(torch.zeros(1))], lr=lr)
    return optimizer, WarmupStableDecay(optimizer, **settings)


def rates(optimizer, schedule, num_steps):
    found = []
    for _ in range(num_steps):
        found.append(optimizer.param_groups[0]["lr"])
        optimizer.step()
        schedule.step()
    return found


def closed_form(step, warmup_steps, decay_start=None, total_steps=None):
    if step < warmup_steps:
        return (step + 1) / warmup_steps
    if decay_start is None or step <= decay_start:
        return 1.0
    return max(0.0, 1 - (step - decay_start) / (total_steps - decay_start))


@pytest.mark.parametrize(
    "settings",
    [
        {"warmup_steps": 0},
        {"warmup_steps": 4},
        {"warmup_steps": 1},
        {"warmup_steps": 3, "decay_start": 8, "total_steps": 13},
        {"warmup_steps": 0, "decay_start": 0, "total_steps": 5},
        {"warmup_steps": 5, "decay_start": 5, "total_steps": 6},
    ],
)
def test_closed_form(settings):
    expected = [2.0 * closed_form(step, **settings) for step in range(20)]
    assert rates(*make(**settings), 20) == pytest.approx(expected)


def test_a_resumed_run_may_get_a_decay():
    optimizer, schedule = make(warmup_steps=2)
    rates(optimizer, schedule, 6)
    again, again_schedule = make(warmup_steps=2, decay_start=8, total_steps=12)
    again.load_state_dict(optimizer.state_dict())
    again_schedule.load_state_dict(schedule.state_dict())
    expected = [2.0 * closed_form(step, 2, 8, 12) for step in range(6, 14)]
    assert rates(again, again_schedule, 8) == pytest.approx(expected)


def test_every_group_keeps_its_own_rate():
    groups = [{"params": [torch.nn.Parameter(torch.zeros(1))], "lr": lr} for lr in (1.0, 4.0)]
    optimizer = torch.optim.SGD(groups)
    WarmupStableDecay(optimizer, warmup_steps=4)
    assert [group["lr"] for group in optimizer.param_groups] == [0.25, 1.0]


@pytest.mark.parametrize("settings", [{"decay_start": 3}, {"total_steps": 3}, {"decay_start": 3, "total_steps": 3}])
def test_rejects_half_a_decay(settings):
    with pytest.raises(ValueError, match=r"Expected 'total_steps' after 'decay_start' \(got .*\)\. Give both, or none"):
        make(**settings)


def test_rejects_a_negative_warm_up():
    with pytest.raises(ValueError, match=r"Expected 'warmup_steps' of at least 0 \(got -1\)\. Use 0"):
        make(warmup_steps=-1)
