import argparse

import pytest
import torch

from dnf_pyg import FAST
from dnf_pyg.commands.settings import add_settings, denoise_settings
from dnf_pyg.mesh import HeatGrowth


def settings(*words):
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_settings(parser)
    return denoise_settings(parser.parse_args(words))


def test_only_what_is_asked_for():
    assert settings() == {}
    assert settings("--strength", "0.5", "--preserve-boundary") == {"strength": 0.5, "preserve_boundary": True}
    found = settings("--growth", "heat", "--precision", "bf16", "--iterations", "7")
    assert isinstance(found["growth"], HeatGrowth)
    assert (found["precision"], found["num_iterations"]) == (torch.bfloat16, 7)


def test_what_is_given_goes_before_fast():
    assert settings("--fast") == dict(FAST)
    assert settings("--fast", "--coverage", "3") == {**FAST, "min_coverage": 3}


@pytest.mark.parametrize("words", [("--strength", "2"), ("--repeat", "0"), ("--max-move", "-1"), ("--max-move", "nan")])
def test_wrong_values(words):
    with pytest.raises(argparse.ArgumentError, match=r"Expected a (whole )?number"):
        settings(*words)
