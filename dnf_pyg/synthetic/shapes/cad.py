"""Random parts with flat and curved sides that meet in sharp edges, as a machine shop would make them."""

import math

import torch

from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.placing import (
    LYING,
    UPRIGHT,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    leaf,
    regular_polygon,
    slab,
    spin,
    tilted,
    tube,
    turned,
)
from dnf_pyg.synthetic.shapes.primitives import ball, blend, box, cone, cylinder, plane, prism, rod, rounded_box, torus
from dnf_pyg.synthetic.shapes.solid import Intersection, Solid, Union

__all__ = [
    "block",
    "bracket",
    "gear",
    "housing",
    "nut",
    "plate",
    "polyhedron",
    "shaft",
    "simple",
    "stairs",
    "tee",
]


def polyhedron(dice: Dice) -> Solid:
    """Convex polyhedron of 5 to 20 random sides: shallow and steep creases."""
    normals = [dice.direction() for _ in range(dice.integer(5, 20))]
    normals += [-torch.stack(normals).sum(0), Z_AXIS, -Z_AXIS, X_AXIS, -X_AXIS, Y_AXIS, -Y_AXIS]
    return Intersection([plane(normal, dice.uniform(0.6, 1.0)) for normal in normals])


def simple(dice: Dice) -> Solid:
    """One of the plain solids: box, pyramid, wedge, cone, rod, prism, cut ball."""
    height = dice.uniform(0.4, 1.0)
    low = plane(-Z_AXIS, 0.5)
    sides = dice.integer(3, 8)
    return dice.choice(
        [
            lambda: box([dice.uniform(0.6, 1.8) for _ in range(3)]),
            lambda: Intersection([low, *(plane(spin(i / sides) + height * Z_AXIS, 0.5) for i in range(sides))]),
            lambda: box([1.6, 1.2, 1.0]) & plane(dice.direction(), dice.uniform(0.0, 0.3)),
            lambda: Intersection([low, plane(Z_AXIS, 0.6), cone(0.8, dice.uniform(0.2, 0.6))]),
            lambda: rod(dice.uniform(0.3, 0.9), -height, height),
            lambda: prism(regular_polygon(sides, 0.9), -height, height),
            lambda: ball(1.0) & plane(dice.direction(), dice.uniform(-0.3, 0.6)),
        ]
    )()


def block(dice: Dice) -> Solid:
    """Box with steps, slots and pockets cut into several sides."""
    size = [dice.uniform(1.0, 1.8) for _ in range(3)]
    solid = box(size)
    for _ in range(dice.integer(1, 5)):
        cutter = box([dice.uniform(0.3, 1.2) for _ in range(3)])
        corner = [dice.uniform(0.2, 0.6) * side * dice.choice([-1, 1]) for side in size]
        solid = solid - cutter.move(UPRIGHT, corner)
    if dice.chance(0.5):
        solid = solid - rod(dice.uniform(0.12, 0.3), -2, 2).move(dice.choice([UPRIGHT, LYING]), dice.normal(3) * 0.1)
    return solid


def plate(dice: Dice) -> Solid:
    """Plate with through holes, countersinks and bosses, some of them with fillets."""
    width, depth, thick = dice.uniform(1.2, 2.0), dice.uniform(1.0, 1.8), dice.uniform(0.15, 0.4)
    top, roof = plane(Z_AXIS, thick), plane(Z_AXIS, thick + dice.uniform(0.3, 0.8))
    boss = cylinder(dice.uniform(0.2, 0.4)).move(UPRIGHT, [dice.uniform(-0.2, 0.2), dice.uniform(-0.2, 0.2), 0])
    rim = rounded_box([width, depth, 9], dice.uniform(0.1, 0.4)) if dice.chance(0.5) else tube(width, depth)
    lid = blend(leaf(top), leaf(boss), dice.uniform(0.1, 0.25)) if dice.chance(0.5) else top | boss
    solid: Solid = Intersection([rim, plane(-Z_AXIS, 0), lid, roof])
    for x in (-1, 1):
        for y in (-1, 1):
            if dice.chance(0.75):
                radius = dice.uniform(0.06, 0.14)
                hole: Solid = cylinder(radius)
                if dice.chance(0.4):
                    hole = hole | cone(2 * radius + 1.0 * thick, -1.0).move(UPRIGHT, [0, 0, 2 * thick])
                solid = solid - hole.move(UPRIGHT, [x * (width / 2 - 0.28), y * (depth / 2 - 0.28), 0])
    return solid


def shaft(dice: Dice) -> Solid:
    """Steps, cones and grooves along one axis, with a keyway or a bore."""
    low = -1.3
    parts: list[Solid] = []
    while low < 0.9:
        high, radius = min(low + dice.uniform(0.3, 0.8), 1.3), dice.uniform(0.25, 0.75)
        if dice.chance(0.3):
            slope = dice.uniform(0.1, 0.4)
            parts.append(Intersection([cone(radius + low * slope, slope), plane(Z_AXIS, high), plane(-Z_AXIS, -low)]))
        else:
            parts.append(rod(radius, low, high))
        low = high - 0.1  # parts overlap: no two of their sides coincide
    solid: Solid = Union([*parts, rod(0.2, -1.25, 1.0)])
    if dice.chance(0.5):
        solid = solid - torus(dice.uniform(0.35, 0.6), dice.uniform(0.08, 0.15)).move(
            UPRIGHT, [0, 0, dice.uniform(-1, 1)]
        )
    if dice.chance(0.5):
        solid = solid - rod(0.1, -2, 2)
    if dice.chance(0.5):
        solid = solid - box([0.15, 2, dice.uniform(0.4, 1.0)]).move(UPRIGHT, [0, 1.25, dice.uniform(-0.8, 0.8)])
    return solid


def bracket(dice: Dice) -> Solid:
    """Two plates at an angle, with holes and a rib or a fillet between them."""
    thick, length, width = dice.uniform(0.15, 0.3), dice.uniform(1.2, 1.7), dice.uniform(0.8, 1.4)
    tilt = math.radians(dice.uniform(-25, 25))
    wall = torch.tensor([math.cos(tilt), 0.0, math.sin(tilt)], dtype=torch.float64)
    floor_top, wall_front = plane(Z_AXIS, thick), plane(wall, thick)
    corner = floor_top | wall_front if dice.chance(0.5) else blend(floor_top, wall_front, dice.uniform(0.2, 0.5))
    solid: Solid = Intersection(
        [
            corner,
            plane(-Z_AXIS, 0),
            plane(-wall, 0),
            plane(X_AXIS, length),
            plane(Z_AXIS, length),
            *slab(Y_AXIS, width / 2),
        ]
    )
    if dice.chance(0.6):
        rib = Intersection([*slab(Y_AXIS, dice.uniform(0.06, 0.15)), plane(X_AXIS + Z_AXIS, dice.uniform(0.6, 0.9)),
                            plane(-X_AXIS, -0.02), plane(-Z_AXIS, -0.02)])  # fmt: skip
        solid = solid | rib
    hole = cylinder(dice.uniform(0.1, 0.25))
    solid = solid - (hole.move(UPRIGHT, [0.7 * length, 0, 0]) & plane(Z_AXIS, thick + 0.2))
    if dice.chance(0.7):
        solid = solid - (hole.move(LYING, [0, 0, 0.7 * length]) & plane(X_AXIS, 0.9))
    return solid.move(UPRIGHT, [-length / 2, 0, -length / 2])


def gear(dice: Dice) -> Solid:
    """Wheel with tapered teeth, a bore and sometimes a hub or lightening holes."""
    teeth, root = dice.integer(7, 20), dice.uniform(0.7, 0.95)
    height, depth = dice.uniform(0.15, 0.4), dice.uniform(0.12, 0.3)
    half = math.pi * root / teeth * 0.55
    tooth = prism(
        [(root - 0.2, -half), (root + depth, -half * 0.6), (root + depth, half * 0.6), (root - 0.2, half)], -3, 3
    )
    spun = [tooth.move(turned(i / teeth)) for i in range(teeth)]
    solid = Union([cylinder(root), *spun]) & Intersection(slab(Z_AXIS, height))
    if dice.chance(0.5):
        solid = solid | rod(0.4, -height - dice.uniform(0.1, 0.3), height + dice.uniform(0.1, 0.3))
    if dice.chance(0.4):
        holes = dice.integer(3, 6)
        ring = [cylinder(0.1).move(UPRIGHT, 0.56 * spin(i / holes)) for i in range(holes)]
        solid = solid - Union(ring)
    return solid - cylinder(dice.uniform(0.12, 0.3))


def nut(dice: Dice) -> Solid:
    """Chamfered prism with a bore, like a nut or a bolt head."""
    height, sides = dice.uniform(0.3, 0.7), dice.choice([4, 6, 6, 8])
    slope = dice.uniform(1.0, 2.5)
    chamfers = [cone(0.93 + slope * height, slope), cone(0.93 + slope * height, -slope)]
    solid = Intersection([prism(regular_polygon(sides, 1.0), -height, height), *chamfers[: dice.integer(0, 2)]])
    if dice.chance(0.5):
        return solid | rod(dice.uniform(0.3, 0.6), 0, 1.3)
    return solid - cylinder(dice.uniform(0.3, 0.55))


def tee(dice: Dice) -> Solid:
    """Pipes that meet, hollow or not, with flanges."""
    outer = dice.uniform(0.35, 0.6)
    branch, tilt = outer * dice.uniform(0.5, 0.9), dice.uniform(50, 90)
    up = tilted(tilt)
    pipe, side = rod(outer, -1.2, 1.2), rod(branch, 0, 1.3).move(up)
    solid = pipe | side
    if dice.chance(0.6):
        solid = Union([solid, rod(outer + 0.2, -1.3, -1.1), rod(branch + 0.2, 1.15, 1.3).move(up)])
    if dice.chance(0.7):
        wall = dice.uniform(0.1, 0.18)
        solid = solid - (cylinder(outer - wall) | (cylinder(branch - wall).move(up) & plane(-up[:, 2], 0)))
    return solid


def housing(dice: Dice) -> Solid:
    """Open box with ribs, bosses and holes in its walls."""
    size, wall = [dice.uniform(1.2, 1.9), dice.uniform(1.0, 1.6), dice.uniform(0.8, 1.2)], dice.uniform(0.1, 0.18)
    rounded = dice.chance(0.5)
    outer: Solid = rounded_box(size, 0.25) if rounded else box(size)
    inner = box([size[0] - 2 * wall, size[1] - 2 * wall, size[2]]).move(UPRIGHT, [0, 0, wall])
    solid = outer - inner
    if rounded:
        solid = solid & plane(Z_AXIS, size[2] / 2 - 0.27)
    if dice.chance(0.6):
        solid = solid | box([dice.uniform(0.08, 0.16), size[1] - wall, size[2] * 0.6]).move(
            UPRIGHT, [dice.uniform(-0.3, 0.3), 0, -size[2] * 0.15]
        )
    if dice.chance(0.6):
        solid = solid - (cylinder(dice.uniform(0.15, 0.3)).move(LYING) & plane(X_AXIS, 0))
    foot = rod(dice.uniform(0.15, 0.22), -size[2] / 2 + 0.02, dice.uniform(0, 0.2)).move(
        UPRIGHT, [-size[0] * 0.3, size[1] * 0.15, 0]
    )
    return solid | foot


def stairs(dice: Dice) -> Solid:
    """Steps or ramps of several slopes on one base."""
    count, width = dice.integer(3, 6), dice.uniform(0.8, 1.6)
    parts = []
    for i in range(count):
        high = -0.6 + dice.uniform(0.15, 1.3)
        lid = (
            plane([math.tan(math.radians(dice.uniform(-50, 50))), 0, 1], high)
            if dice.chance(0.4)
            else plane(Z_AXIS, high)
        )
        parts.append(lid & Intersection([plane(X_AXIS, -1 + 2 * (i + 1) / count), plane(-X_AXIS, 1 - 2 * i / count)]))
    sides = [*slab(Y_AXIS, width / 2), plane(-Z_AXIS, 0.7), plane(Z_AXIS, 1.2)]
    return Intersection([Union([*parts, plane(Z_AXIS, -0.5) & Intersection(slab(X_AXIS, 1))]), *sides])
