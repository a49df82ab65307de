"""Random bodies with sharp and curved creases that no single machine would make: stars, lenses, twists, carvings."""

import math

import torch
from torch import Tensor

from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.placing import (
    UPRIGHT,
    Z_AXIS,
    axis_frame,
    regular_polygon,
    slab,
    spin,
    turned,
    wall_through,
)
from dnf_pyg.synthetic.shapes.primitives import ball, box, cone, cylinder, plane, prism, rod, rounded_box, torus
from dnf_pyg.synthetic.shapes.solid import Intersection, Solid, Union

__all__ = [
    "carving",
    "csg",
    "lens",
    "profile",
    "star",
    "twist",
]


def star(dice: Dice) -> Solid:
    """Star: a prism or a ridge roof over a star polygon, or spikes in all directions."""
    points, inner = dice.integer(4, 8), dice.uniform(0.35, 0.6)
    if dice.chance(0.4):
        axes = [dice.direction() for _ in range(dice.integer(4, 9))]
        spikes = [
            Intersection([cone(0.35, 0.3), plane(-Z_AXIS, 0), plane(Z_AXIS, 1.0)]).move(axis_frame(axis))
            for axis in axes
        ]
        return Union([ball(dice.uniform(0.4, 0.6)), *spikes])
    ridge, height = dice.uniform(0.5, 2.0), dice.uniform(0.3, 0.8)
    arms = []
    for i in range(points):
        tip, left, right = 1.4 * spin(i / points), inner * spin((i - 0.5) / points), inner * spin((i + 0.5) / points)
        walls = [wall_through(left, tip, ridge), wall_through(tip, right, ridge)]
        arms.append(Intersection([*walls, plane(-spin(i / points), 0.05)]))
    lids = [plane(Z_AXIS, height * dice.uniform(0.3, 0.9)), plane(-Z_AXIS, 0.3)]
    return Intersection([Union(arms), *lids])


def lens(dice: Dice) -> Solid:
    """Curved creases: bodies bounded by several spheres and cylinders."""
    if dice.chance(0.4):
        petals = dice.integer(3, 8)
        ring = [cylinder(0.45).move(UPRIGHT, 0.7 * spin(i / petals)) for i in range(petals)]
        return Intersection([Union([*ring, cylinder(0.6)]), ball(1.5, (0, 0, -1)), ball(1.5, (0, 0, 1))])
    parts = [ball(dice.uniform(1.1, 1.6), (0.7 * dice.direction()).tolist()) for _ in range(dice.integer(3, 6))]
    return Intersection([*parts, cylinder(dice.uniform(0.5, 0.8)).move(dice.rotation())])


def twist(dice: Dice) -> Solid:
    """Prism twisted and tapered along its axis: curved creases and ruled sides."""
    turn, taper, sides = dice.uniform(-1.0, 1.0), dice.uniform(0.0, 0.3), dice.integer(3, 7)
    solid = prism(regular_polygon(sides, dice.uniform(0.6, 0.9)), -1, 1)

    def untwist(pos: Tensor) -> Tensor:
        x, y, z = pos.unbind(1)
        c, s, grow = torch.cos(turn * z), torch.sin(turn * z), 1 + taper * z
        return torch.stack([(c * x + s * y) * grow, (c * y - s * x) * grow, z], 1)

    return solid.map(untwist)


def profile(dice: Dice) -> Solid:
    """Swept outline of straight and round parts, as extruded bars have."""
    half = dice.uniform(0.4, 1.2)
    shapes: list[Solid] = []
    for _ in range(dice.integer(2, 5)):
        centre = [dice.uniform(-0.6, 0.6), dice.uniform(-0.6, 0.6), 0]
        bar = (
            box([dice.uniform(0.2, 1.2), dice.uniform(0.2, 1.2), 9])
            if dice.chance(0.6)
            else cylinder(dice.uniform(0.2, 0.5))
        )
        shapes.append(bar.move(turned(dice.uniform(0, 1)) if dice.chance(0.5) else UPRIGHT, centre))
    solid = Union([box([0.8, 0.5, 9]), *shapes]) & Intersection(slab(Z_AXIS, half))
    return solid - cylinder(dice.uniform(0.1, 0.2)) if dice.chance(0.6) else solid


def csg(dice: Dice) -> Solid:
    """Random tree of unions and differences of parts in random places and directions."""
    solid = _part(dice, 1.0)
    for _ in range(dice.integer(1, 4)):
        other = _part(dice, dice.uniform(0.4, 0.9)).move(UPRIGHT, 0.6 * dice.normal(3).clamp(-1.5, 1.5))
        solid = solid - other if dice.chance(0.45) else solid | other
    return solid & ball(1.75)


def carving(dice: Dice) -> Solid:
    """Ball, rounded box or rod with grooves, dimples and raised bands: sharp details on a curved body."""
    body = dice.choice([ball(1.0), rounded_box([1.7, 1.5, 1.3], 0.4), rod(0.8, -0.9, 0.9)])
    for _ in range(dice.integer(3, 8)):
        offset = dice.uniform(-0.5, 0.5)
        tools: list[Solid] = [
            torus(math.sqrt(1 - offset**2), dice.uniform(0.08, 0.15)).move(UPRIGHT, [0, 0, offset]),
            ball(dice.uniform(0.2, 0.4), (1.0, 0, 0)),
            box([0.16, 0.5, 0.5]).move(turned(dice.uniform(0, 1)), [0.95, 0, 0]),
            rod(dice.uniform(0.1, 0.25), 0.6, 1.15),
        ]
        tool = dice.choice(tools).move(dice.rotation())
        body = body | tool if dice.chance(0.4) else body - tool
    return body


def _part(dice: Dice, scale: float) -> Solid:
    size = [scale * dice.uniform(0.6, 1.6) for _ in range(3)]
    return dice.choice(
        [
            lambda: box(size),
            lambda: rod(0.5 * size[0], -size[1] / 2, size[1] / 2),
            lambda: ball(0.5 * size[0]),
            lambda: rounded_box(size, 0.2 * min(size)),
            lambda: Intersection(
                [cone(0.5 * size[0], 0.4), plane(Z_AXIS, 0.3 * size[1]), plane(-Z_AXIS, 0.3 * size[1])]
            ),
            lambda: torus(0.45 * size[0], 0.18 * size[0]),
            lambda: prism(regular_polygon(dice.integer(3, 7), 0.6 * size[0]), -size[1] / 2, size[1] / 2),
        ]
    )().move(dice.rotation() if dice.chance(0.6) else UPRIGHT)
