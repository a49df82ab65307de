import pytest
import torch

from dnf_pyg.view.movement import scale_end, signed_movement


def test_movement_along_the_normal_is_signed_and_across_it_none(sphere_mesh):
    pos, face = sphere_mesh
    edge = torch.cat([pos[face[i]] - pos[face[i - 1]] for i in range(3)]).norm(dim=1).mean()  # every edge twice
    for scale in (1.1, 0.9):
        expected = torch.full((len(pos),), float((scale - 1) / edge), dtype=pos.dtype)
        torch.testing.assert_close(signed_movement(pos, scale * pos, face), expected, rtol=1e-2, atol=0)
    turned = pos @ torch.tensor([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]], dtype=pos.dtype)
    quarter = signed_movement(pos, turned, face)
    top = pos[:, 2].argmax()
    assert quarter[top].abs() < 1e-6


@pytest.mark.parametrize(("largest", "end"), [(0.9, 1.0), (1.1, 2.0), (0.0041, 0.008), (-35.0, 40.0), (1e-9, 1e-9)])
def test_scale_ends_at_a_round_number_above(largest, end):
    assert scale_end(torch.full((1000,), largest, dtype=torch.float64)) == pytest.approx(end)


def test_one_percent_may_lie_beyond():
    values = torch.ones(1000)
    values[:9] = 50
    assert scale_end(values) == 1.0
    assert scale_end(torch.empty(0)) == 1.0
