import math
from itertools import pairwise

import pytest
import torch

from dnf_pyg.mesh.concentration import concentration


def directions(num, seed=0):
    normal = torch.randn(num, 3, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    return torch.nn.functional.normalize(normal, dim=1)


def test_matches_loop_over_pairs():
    normal = directions(40)
    width = math.radians(15)
    pairs = [math.exp((float(one @ other) - 1) / width**2) for one in normal for other in normal]
    assert concentration(normal) == pytest.approx(2 / width**2 * sum(pairs) / len(pairs))


def test_even_normals_have_one_and_equal_ones_the_most():
    assert concentration(directions(10_000)) == pytest.approx(1, abs=0.05)
    assert concentration(directions(1).expand(500, 3)) == pytest.approx(2 / math.radians(15) ** 2)
    assert concentration(torch.empty(0, 3)) == 0


def test_turning_all_normals_changes_nothing():
    normal = directions(500)[:, [0, 1, 2]] * torch.tensor([1.0, 1, 3])
    normal = torch.nn.functional.normalize(normal, dim=1)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)).Q
    assert concentration(normal @ turn) == pytest.approx(concentration(normal))


@pytest.mark.parametrize("shape", [torch.eye(3), directions(20), directions(3000)], ids=["corner", "gem", "ball"])
def test_noise_lowers_it(shape):
    clean = shape.double().repeat(3000 // len(shape), 1)
    found = [
        concentration(torch.nn.functional.normalize(clean + spread * directions(len(clean), seed=2), dim=1))
        for spread in (0, 0.1, 0.3, 0.6)
    ]
    assert all(after < before * 1.02 for before, after in pairwise(found))


def test_of_many_a_sample_counts():
    normal = torch.cat([directions(9000), directions(1).expand(1000, 3)])
    assert concentration(normal) == pytest.approx(concentration(normal[::5]), rel=0.1)
    assert concentration(normal) == concentration(normal)
