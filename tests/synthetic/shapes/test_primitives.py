import math

import pytest
import torch
import trimesh

from dnf_pyg.synthetic.shapes.primitives import (
    ball,
    blend,
    box,
    cone,
    cylinder,
    ellipsoid,
    plane,
    prism,
    rod,
    rounded_box,
)
from dnf_pyg.synthetic.shapes.primitives import torus as torus_of

POINTS = 4 * torch.rand(300, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) - 2
X, Y, Z = POINTS.unbind(1)
RADIUS = torch.hypot(X, Y)


@pytest.mark.parametrize(
    ("solid", "distance"),
    [
        (plane((0, 3, 4), 0.5), 0.6 * Y + 0.8 * Z - 0.5),
        (ball(0.7, (0.1, 0.2, 0.3)), (POINTS - torch.tensor([0.1, 0.2, 0.3])).norm(dim=1) - 0.7),
        (cylinder(0.6), RADIUS - 0.6),
        (cone(0.8, 0.5), (RADIUS - 0.8 + 0.5 * Z) / math.hypot(1, 0.5)),
        (torus_of(1.0, 0.3), torch.hypot(RADIUS - 1, Z) - 0.3),
    ],
    ids=["plane", "ball", "cylinder", "cone", "torus"],
)
def test_fields_are_distances(solid, distance):
    torch.testing.assert_close(solid.evaluate(POINTS)[0], distance, atol=1e-6, rtol=0)


@pytest.mark.parametrize(
    ("solid", "mesh"),
    [
        (box([1.0, 2.0, 3.0]), trimesh.creation.box((1.0, 2.0, 3.0))),
        (rod(0.8, -1, 1), trimesh.creation.cylinder(0.8, 2, sections=4000)),
        (prism([(0, 0), (1, 0), (0, 1)], -1, 1.5),
         trimesh.convex.convex_hull([(x, y, z) for x, y in ((0, 0), (1, 0), (0, 1)) for z in (-1, 1.5)])),
    ],
    ids=["box", "rod", "prism"],
)  # fmt: skip
def test_inside_is_inside(solid, mesh):
    inside = torch.from_numpy(mesh.contains(POINTS.numpy()))
    assert torch.equal(solid.evaluate(POINTS)[0] < 0, inside)
    assert 5 < inside.sum() < 295


def test_ellipsoid_has_its_radii():
    tips = torch.diag(torch.tensor([0.5, 1.0, 1.5], dtype=torch.float64))
    value, slope = ellipsoid([0.5, 1.0, 1.5]).slope(tips)
    torch.testing.assert_close(value, torch.zeros(3, dtype=torch.float64))
    torch.testing.assert_close(slope, torch.eye(3, dtype=torch.float64))  # about a distance there


def test_rounded_box_is_a_box_grown_by_its_radius():
    core = POINTS.abs() - (torch.tensor([1.0, 1.5, 2.0]) / 2 - 0.2)
    outside = (core > 0).any(dim=1)
    expected = core.clamp(min=0).norm(dim=1) - 0.2
    torch.testing.assert_close(rounded_box([1.0, 1.5, 2.0], 0.2).evaluate(POINTS)[0][outside], expected[outside])


def test_blend_fills_the_inner_edge_and_nothing_else():
    one, two = plane((1, 0, 0), 0.0), plane((0, 0, 1), 0.0)
    value, union = blend(one, two, 0.3).evaluate(POINTS)[0], (one | two).evaluate(POINTS)[0]
    far = (X - Z).abs() > 0.3
    torch.testing.assert_close(value[far], union[far])
    assert (value <= union).all()
    middle = torch.zeros(1, 3, dtype=torch.float64)
    assert float(blend(one, two, 0.3).evaluate(middle)[0]) == pytest.approx(-0.075)
