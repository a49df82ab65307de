import pytest
import torch
from torch_geometric.data import Batch, Data

from dnf_pyg.patches.rotation import random_rotations, rotate_patches


@pytest.fixture
def patches():
    generator = torch.Generator().manual_seed(0)

    def vectors(*shape):
        return torch.nn.functional.normalize(torch.randn(*shape, 3, generator=generator), dim=-1)

    return [Data(x=vectors(n), y=vectors(n), pos=vectors(n), earlier=vectors(n, 2), area=vectors(n)) for n in (4, 1, 6)]


def test_matrices_are_proper_rotations_uniform_over_all():
    rotation = random_rotations(4000, torch.Generator().manual_seed(0))
    torch.testing.assert_close(rotation @ rotation.mT, torch.eye(3).expand(4000, 3, 3), atol=1e-5, rtol=0)
    torch.testing.assert_close(rotation.det(), torch.ones(4000))
    assert rotation.mean(dim=0).abs().max() < 0.05
    angle = torch.acos(((rotation.diagonal(dim1=1, dim2=2).sum(dim=1) - 1) / 2).clamp(-1, 1))
    assert float(angle.mean()) == pytest.approx(torch.pi / 2 + 2 / torch.pi, abs=0.05)  # density (1 - cos) / pi


def test_each_patch_of_a_batch_is_rotated_by_its_own(patches):
    rotation = random_rotations(3, torch.Generator().manual_seed(1))
    found = rotate_patches(Batch.from_data_list(patches), rotation)
    for row, (one, patch) in enumerate(zip(found.to_data_list(), patches, strict=True)):
        for name in ("x", "y", "pos"):
            torch.testing.assert_close(one[name], torch.stack([rotation[row] @ vector for vector in patch[name]]))
        expected = [torch.stack([rotation[row] @ vector for vector in pair]) for pair in patch.earlier]
        torch.testing.assert_close(one.earlier, torch.stack(expected))
        assert torch.equal(one.area, patch.area)


def test_one_rotation_for_all(patches):
    rotation, batch = random_rotations(1), Batch.from_data_list(patches)
    torch.testing.assert_close(rotate_patches(batch, rotation).x, batch.x @ rotation[0].t())


def test_inverse_restores_and_the_input_stays(patches):
    batch, rotation = Batch.from_data_list(patches), random_rotations(3)
    before = batch.x.clone()
    there = rotate_patches(batch, rotation)
    assert torch.equal(batch.x, before)
    torch.testing.assert_close(rotate_patches(there, rotation.mT).x, before)
