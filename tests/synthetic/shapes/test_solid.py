import pytest
import torch

from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.primitives import ball, box, plane, torus
from dnf_pyg.synthetic.shapes.solid import Intersection, Union

POINTS = 3 * torch.rand(400, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 1.5
ONE, TWO = box([1.6, 1.0, 1.2]), ball(0.8, (0.3, 0.2, 0.0))


def value(solid):
    return solid.evaluate(POINTS)[0]


@pytest.mark.parametrize(
    ("joined", "expected"),
    [
        (ONE | TWO, torch.minimum(value(ONE), value(TWO))),
        (ONE & TWO, torch.maximum(value(ONE), value(TWO))),
        (ONE - TWO, torch.maximum(value(ONE), -value(TWO))),
        (~(ONE | TWO), value(~ONE & ~TWO)),
        (~(ONE - TWO), value(~ONE | TWO)),
    ],
    ids=["union", "intersection", "difference", "complement of a union", "complement of a difference"],
)
def test_joining_two_solids(joined, expected):
    torch.testing.assert_close(value(joined), expected)


def test_a_label_is_the_row_of_the_surface_that_decides():
    solid = Union([Intersection([plane((0, 0, 1), 0.2), plane((0, 0, -1), 0.3)]), torus(0.8, 0.3)])
    found, label = solid.evaluate(POINTS)
    by_surface = torch.stack([surface.field(POINTS) for surface in solid.surfaces])
    torch.testing.assert_close(by_surface.gather(0, label[None])[0], found)
    assert set(label.tolist()) == {0, 1, 2}


def test_moving_takes_points_along():
    turn, shift = Dice(torch.Generator().manual_seed(1)).rotation(), torch.tensor([0.4, -0.2, 0.1]).double()
    moved = (ONE - TWO).move(turn, shift)
    torch.testing.assert_close(moved.evaluate(POINTS @ turn.t() + shift)[0], value(ONE - TWO))
    found, label = moved.evaluate(POINTS @ turn.t() + shift)
    normal, before = moved.normals(POINTS @ turn.t() + shift, label), (ONE - TWO).normals(POINTS, label)
    torch.testing.assert_close(normal, before @ turn.t())
    assert found.shape == (400,)


def test_normals_are_those_of_finite_differences():
    solid = ONE - TWO
    _, label = solid.evaluate(POINTS)
    step = 1e-6 * torch.eye(3, dtype=torch.float64)
    slope = torch.stack(
        [
            torch.stack([(surface.field(POINTS + d) - surface.field(POINTS - d)) / 2e-6 for surface in solid.surfaces])
            for d in step
        ],
        dim=-1,
    )  # (surfaces, P, 3)
    expected = torch.nn.functional.normalize(slope[label, torch.arange(len(POINTS))], dim=1)
    torch.testing.assert_close(solid.normals(POINTS, label), expected, atol=1e-6, rtol=0)
