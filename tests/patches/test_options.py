from dataclasses import FrozenInstanceError

import pytest

from dnf_pyg.mesh import HeatGrowth
from dnf_pyg.patches import PatchOptions


def test_repr_tells_every_value():
    expected = "PatchOptions(num_patches=3, patch_size=800, k=50, growth=HeatGrowth(), seed=0)"
    assert repr(PatchOptions(3, growth=HeatGrowth())) == expected


def test_are_frozen():
    with pytest.raises(FrozenInstanceError):
        PatchOptions().k = 3


def test_rejects_num_patches():
    with pytest.raises(ValueError, match=r"Expected 'num_patches' of at least 1 \(got 0\). Raise it."):
        PatchOptions(num_patches=0)
