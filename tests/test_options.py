import dataclasses

import pytest

from dnf_pyg import FAST, FilterOptions, OptionError, UpdateOptions


@pytest.mark.parametrize(
    ("kind", "name", "value", "text"),
    [
        (FilterOptions, "k", (10, 0), r"Expected 'k' to be a whole number of at least 1 \(got 0\)"),
        (FilterOptions, "patch_size", 0, r"'patch_size' to be a whole number from 1 to 32767 \(got 0\)"),
        (FilterOptions, "patch_size", 32768, r"from 1 to 32767 \(got 32768\)"),
        (FilterOptions, "coverage", 0, r"'coverage' to be a whole number of at least 1 \(got 0\)"),
        (FilterOptions, "smoothing", 1.5, r"'smoothing' to be a number from 0 to 1 \(got 1.5\)"),
        (FilterOptions, "coverage", 1.5, r"'coverage' to be a whole number of at least 1 \(got 1.5\)"),
        (FilterOptions, "batch_size", True, r"'batch_size' to be a whole number of at least 1 \(got True\)"),
        (FilterOptions, "seed", -1, r"'seed' to be a whole number from 0 to"),
        (FilterOptions, "growth", "hat", r"'growth' to be one of dijkstra, heat \(got hat\). Choose one of these."),
        (FilterOptions, "precision", "fp16", r"'precision' to be one of auto, fp32, bf16 \(got fp16\)"),
        (
            UpdateOptions,
            "strength",
            1.5,
            r"a number from 0 to 1 \(got 1.5\). Choose a number in this range.",
        ),
        (UpdateOptions, "strength", float("nan"), r"'strength' to be a number from 0 to 1 \(got nan\)"),
        (UpdateOptions, "strength", "half", r"'strength' to be a number from 0 to 1 \(got half\)"),
        (UpdateOptions, "max_move", -1.0, r"'max_move' to be a number of at least 0 \(got -1.0\)"),
        (UpdateOptions, "num_iterations", -1, r"'num_iterations' to be a whole number of at least 0 \(got -1\)"),
        (UpdateOptions, "early_stopping", "on", r"'early_stopping' to be one of auto, always, never \(got on\)"),
    ],
)
def test_rejects_values_out_of_range(kind, name, value, text):
    with pytest.raises(OptionError, match=text) as caught:
        kind(**{name: value})
    assert isinstance(caught.value, ValueError)


def test_limits_are_allowed():
    FilterOptions(k=(1,), patch_size=32767, coverage=1, batch_size=1, seed=2**63 - 1)
    UpdateOptions(strength=0, max_move=0, num_iterations=0, early_stopping="always")
    UpdateOptions(strength=1, early_stopping="never")


def test_fast_differs_in_coverage_and_neighbours_only():
    assert dataclasses.replace(FAST, coverage=2, k=None) == FilterOptions()
    assert (FAST.coverage, FAST.k) == (1, (10, 16, 24))


def test_options_do_not_change():
    with pytest.raises(dataclasses.FrozenInstanceError):
        FAST.coverage = 2
