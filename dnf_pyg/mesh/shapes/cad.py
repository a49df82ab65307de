"""Random parts with flat and curved sides that meet in sharp edges, as a machine shop would make them."""

import math

import torch
from torch import Tensor

from dnf_pyg.mesh.shapes.dice import Dice
from dnf_pyg.mesh.shapes.primitives import ball, blend, box, cone, cylinder, plane, prism, rod, rounded_box, torus
from dnf_pyg.mesh.shapes.solid import Intersection, Solid, Surface, Union

__all__ = [
    "block", "bracket", "carving", "csg", "gear", "housing", "lens", "nut", "plate", "polyhedron", "profile", "shaft",
    "simple", "stairs", "star", "tee", "twist",
]  # fmt: skip

_X, _Y, _Z = torch.eye(3, dtype=torch.float64)
_FLAT = torch.eye(3, dtype=torch.float64)
_LYING = torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=torch.float64)  # turns the z axis to x


def polyhedron(dice: Dice) -> Solid:
    """Convex polyhedron of 5 to 20 random sides: shallow and steep creases."""
    normals = [dice.direction() for _ in range(dice.integer(5, 20))]
    normals += [-torch.stack(normals).sum(0), _Z, -_Z, _X, -_X, _Y, -_Y]
    return Intersection([plane(normal, dice.uniform(0.6, 1.0)) for normal in normals])


def simple(dice: Dice) -> Solid:
    """One of the plain solids: box, pyramid, wedge, cone, rod, prism, cut ball."""
    height = dice.uniform(0.4, 1.0)
    low = plane(-_Z, 0.5)
    sides = dice.integer(3, 8)
    return dice.choice(
        [
            lambda: box([dice.uniform(0.6, 1.8) for _ in range(3)]),
            lambda: Intersection([low, *(plane(_spin(i / sides) + height * _Z, 0.5) for i in range(sides))]),
            lambda: box([1.6, 1.2, 1.0]) & plane(dice.direction(), dice.uniform(0.0, 0.3)),
            lambda: Intersection([low, plane(_Z, 0.6), cone(0.8, dice.uniform(0.2, 0.6))]),
            lambda: rod(dice.uniform(0.3, 0.9), -height, height),
            lambda: prism(_polygon(sides, 0.9), -height, height),
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
        solid = solid - cutter.move(_FLAT, corner)
    if dice.chance(0.5):
        solid = solid - rod(dice.uniform(0.12, 0.3), -2, 2).move(dice.choice([_FLAT, _LYING]), dice.normal(3) * 0.1)
    return solid


def plate(dice: Dice) -> Solid:
    """Plate with through holes, countersinks and bosses, some of them with fillets."""
    width, depth, thick = dice.uniform(1.2, 2.0), dice.uniform(1.0, 1.8), dice.uniform(0.15, 0.4)
    top, roof = plane(_Z, thick), plane(_Z, thick + dice.uniform(0.3, 0.8))
    boss = cylinder(dice.uniform(0.2, 0.4)).move(_FLAT, [dice.uniform(-0.2, 0.2), dice.uniform(-0.2, 0.2), 0])
    rim = rounded_box([width, depth, 9], dice.uniform(0.1, 0.4)) if dice.chance(0.5) else _frame(width, depth)
    lid = blend(_leaf(top), _leaf(boss), dice.uniform(0.1, 0.25)) if dice.chance(0.5) else top | boss
    solid: Solid = Intersection([rim, plane(-_Z, 0), lid, roof])
    for x in (-1, 1):
        for y in (-1, 1):
            if dice.chance(0.75):
                radius = dice.uniform(0.06, 0.14)
                hole: Solid = cylinder(radius)
                if dice.chance(0.4):
                    hole = hole | cone(2 * radius + 1.0 * thick, -1.0).move(_FLAT, [0, 0, 2 * thick])
                solid = solid - hole.move(_FLAT, [x * (width / 2 - 0.28), y * (depth / 2 - 0.28), 0])
    return solid


def shaft(dice: Dice) -> Solid:
    """Steps, cones and grooves along one axis, with a keyway or a bore."""
    low = -1.3
    parts: list[Solid] = []
    while low < 0.9:
        high, radius = min(low + dice.uniform(0.3, 0.8), 1.3), dice.uniform(0.25, 0.75)
        if dice.chance(0.3):
            slope = dice.uniform(0.1, 0.4)
            parts.append(Intersection([cone(radius + low * slope, slope), plane(_Z, high), plane(-_Z, -low)]))
        else:
            parts.append(rod(radius, low, high))
        low = high - 0.1  # parts overlap: no two of their sides coincide
    solid: Solid = Union([*parts, rod(0.2, -1.25, 1.0)])
    if dice.chance(0.5):
        solid = solid - torus(dice.uniform(0.35, 0.6), dice.uniform(0.08, 0.15)).move(
            _FLAT, [0, 0, dice.uniform(-1, 1)]
        )
    if dice.chance(0.5):
        solid = solid - rod(0.1, -2, 2)
    if dice.chance(0.5):
        solid = solid - box([0.15, 2, dice.uniform(0.4, 1.0)]).move(_FLAT, [0, 1.25, dice.uniform(-0.8, 0.8)])
    return solid


def bracket(dice: Dice) -> Solid:
    """Two plates at an angle, with holes and a rib or a fillet between them."""
    thick, length, width = dice.uniform(0.15, 0.3), dice.uniform(1.2, 1.7), dice.uniform(0.8, 1.4)
    tilt = math.radians(dice.uniform(-25, 25))
    wall = torch.tensor([math.cos(tilt), 0.0, math.sin(tilt)], dtype=torch.float64)
    floor_top, wall_front = plane(_Z, thick), plane(wall, thick)
    corner = floor_top | wall_front if dice.chance(0.5) else blend(floor_top, wall_front, dice.uniform(0.2, 0.5))
    solid: Solid = Intersection(
        [corner, plane(-_Z, 0), plane(-wall, 0), plane(_X, length), plane(_Z, length), *_slab(_Y, width / 2)]
    )
    if dice.chance(0.6):
        rib = Intersection([*_slab(_Y, dice.uniform(0.06, 0.15)), plane(_X + _Z, dice.uniform(0.6, 0.9)),
                            plane(-_X, -0.02), plane(-_Z, -0.02)])  # fmt: skip
        solid = solid | rib
    hole = cylinder(dice.uniform(0.1, 0.25))
    solid = solid - (hole.move(_FLAT, [0.7 * length, 0, 0]) & plane(_Z, thick + 0.2))
    if dice.chance(0.7):
        solid = solid - (hole.move(_LYING, [0, 0, 0.7 * length]) & plane(_X, 0.9))
    return solid.move(_FLAT, [-length / 2, 0, -length / 2])


def gear(dice: Dice) -> Solid:
    """Wheel with tapered teeth, a bore and sometimes a hub or lightening holes."""
    teeth, root = dice.integer(7, 20), dice.uniform(0.7, 0.95)
    height, depth = dice.uniform(0.15, 0.4), dice.uniform(0.12, 0.3)
    half = math.pi * root / teeth * 0.55
    tooth = prism(
        [(root - 0.2, -half), (root + depth, -half * 0.6), (root + depth, half * 0.6), (root - 0.2, half)], -3, 3
    )
    spun = [tooth.move(_turn(i / teeth)) for i in range(teeth)]
    solid = Union([cylinder(root), *spun]) & Intersection(_slab(_Z, height))
    if dice.chance(0.5):
        solid = solid | rod(0.4, -height - dice.uniform(0.1, 0.3), height + dice.uniform(0.1, 0.3))
    if dice.chance(0.4):
        holes = dice.integer(3, 6)
        ring = [cylinder(0.1).move(_FLAT, 0.56 * _spin(i / holes)) for i in range(holes)]
        solid = solid - Union(ring)
    return solid - cylinder(dice.uniform(0.12, 0.3))


def nut(dice: Dice) -> Solid:
    """Chamfered prism with a bore, like a nut or a bolt head."""
    height, sides = dice.uniform(0.3, 0.7), dice.choice([4, 6, 6, 8])
    slope = dice.uniform(1.0, 2.5)
    chamfers = [cone(0.93 + slope * height, slope), cone(0.93 + slope * height, -slope)]
    solid = Intersection([prism(_polygon(sides, 1.0), -height, height), *chamfers[: dice.integer(0, 2)]])
    if dice.chance(0.5):
        return solid | rod(dice.uniform(0.3, 0.6), 0, 1.3)
    return solid - cylinder(dice.uniform(0.3, 0.55))


def tee(dice: Dice) -> Solid:
    """Pipes that meet, hollow or not, with flanges."""
    outer = dice.uniform(0.35, 0.6)
    branch, tilt = outer * dice.uniform(0.5, 0.9), dice.uniform(50, 90)
    up = _tilted(tilt)
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
    inner = box([size[0] - 2 * wall, size[1] - 2 * wall, size[2]]).move(_FLAT, [0, 0, wall])
    solid = outer - inner
    if rounded:
        solid = solid & plane(_Z, size[2] / 2 - 0.27)
    if dice.chance(0.6):
        solid = solid | box([dice.uniform(0.08, 0.16), size[1] - wall, size[2] * 0.6]).move(
            _FLAT, [dice.uniform(-0.3, 0.3), 0, -size[2] * 0.15]
        )
    if dice.chance(0.6):
        solid = solid - (cylinder(dice.uniform(0.15, 0.3)).move(_LYING) & plane(_X, 0))
    foot = rod(dice.uniform(0.15, 0.22), -size[2] / 2 + 0.02, dice.uniform(0, 0.2)).move(
        _FLAT, [-size[0] * 0.3, size[1] * 0.15, 0]
    )
    return solid | foot


def stairs(dice: Dice) -> Solid:
    """Steps or ramps of several slopes on one base."""
    count, width = dice.integer(3, 6), dice.uniform(0.8, 1.6)
    parts = []
    for i in range(count):
        high = -0.6 + dice.uniform(0.15, 1.3)
        lid = (
            plane([math.tan(math.radians(dice.uniform(-50, 50))), 0, 1], high) if dice.chance(0.4) else plane(_Z, high)
        )
        parts.append(lid & Intersection([plane(_X, -1 + 2 * (i + 1) / count), plane(-_X, 1 - 2 * i / count)]))
    sides = [*_slab(_Y, width / 2), plane(-_Z, 0.7), plane(_Z, 1.2)]
    return Intersection([Union([*parts, plane(_Z, -0.5) & Intersection(_slab(_X, 1))]), *sides])


def star(dice: Dice) -> Solid:
    """Star: a prism or a ridge roof over a star polygon, or spikes in all directions."""
    points, inner = dice.integer(4, 8), dice.uniform(0.35, 0.6)
    if dice.chance(0.4):
        axes = [dice.direction() for _ in range(dice.integer(4, 9))]
        spikes = [Intersection([cone(0.35, 0.3), plane(-_Z, 0), plane(_Z, 1.0)]).move(_frame_of(axis)) for axis in axes]
        return Union([ball(dice.uniform(0.4, 0.6)), *spikes])
    ridge, height = dice.uniform(0.5, 2.0), dice.uniform(0.3, 0.8)
    arms = []
    for i in range(points):
        tip, left, right = 1.4 * _spin(i / points), inner * _spin((i - 0.5) / points), inner * _spin((i + 0.5) / points)
        walls = [_through(left, tip, ridge), _through(tip, right, ridge)]
        arms.append(Intersection([*walls, plane(-_spin(i / points), 0.05)]))
    lids = [plane(_Z, height * dice.uniform(0.3, 0.9)), plane(-_Z, 0.3)]
    return Intersection([Union(arms), *lids])


def lens(dice: Dice) -> Solid:
    """Curved creases: bodies bounded by several spheres and cylinders."""
    if dice.chance(0.4):
        petals = dice.integer(3, 8)
        ring = [cylinder(0.45).move(_FLAT, 0.7 * _spin(i / petals)) for i in range(petals)]
        return Intersection([Union([*ring, cylinder(0.6)]), ball(1.5, (0, 0, -1)), ball(1.5, (0, 0, 1))])
    parts = [ball(dice.uniform(1.1, 1.6), (0.7 * dice.direction()).tolist()) for _ in range(dice.integer(3, 6))]
    return Intersection([*parts, cylinder(dice.uniform(0.5, 0.8)).move(dice.rotation())])


def twist(dice: Dice) -> Solid:
    """Prism twisted and tapered along its axis: curved creases and ruled sides."""
    turn, taper, sides = dice.uniform(-1.0, 1.0), dice.uniform(0.0, 0.3), dice.integer(3, 7)
    solid = prism(_polygon(sides, dice.uniform(0.6, 0.9)), -1, 1)

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
        shapes.append(bar.move(_turn(dice.uniform(0, 1)) if dice.chance(0.5) else _FLAT, centre))
    solid = Union([box([0.8, 0.5, 9]), *shapes]) & Intersection(_slab(_Z, half))
    return solid - cylinder(dice.uniform(0.1, 0.2)) if dice.chance(0.6) else solid


def csg(dice: Dice) -> Solid:
    """Random tree of unions and differences of parts in random places and directions."""
    solid = _part(dice, 1.0)
    for _ in range(dice.integer(1, 4)):
        other = _part(dice, dice.uniform(0.4, 0.9)).move(_FLAT, 0.6 * dice.normal(3).clamp(-1.5, 1.5))
        solid = solid - other if dice.chance(0.45) else solid | other
    return solid & ball(1.75)


def carving(dice: Dice) -> Solid:
    """Ball, rounded box or rod with grooves, dimples and raised bands: sharp details on a curved body."""
    body = dice.choice([ball(1.0), rounded_box([1.7, 1.5, 1.3], 0.4), rod(0.8, -0.9, 0.9)])
    for _ in range(dice.integer(3, 8)):
        offset = dice.uniform(-0.5, 0.5)
        tools: list[Solid] = [
            torus(math.sqrt(1 - offset**2), dice.uniform(0.08, 0.15)).move(_FLAT, [0, 0, offset]),
            ball(dice.uniform(0.2, 0.4), (1.0, 0, 0)),
            box([0.16, 0.5, 0.5]).move(_turn(dice.uniform(0, 1)), [0.95, 0, 0]),
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
            lambda: Intersection([cone(0.5 * size[0], 0.4), plane(_Z, 0.3 * size[1]), plane(-_Z, 0.3 * size[1])]),
            lambda: torus(0.45 * size[0], 0.18 * size[0]),
            lambda: prism(_polygon(dice.integer(3, 7), 0.6 * size[0]), -size[1] / 2, size[1] / 2),
        ]
    )().move(dice.rotation() if dice.chance(0.6) else _FLAT)


def _leaf(solid: Solid) -> Surface:
    (surface,) = solid.surfaces
    return surface


def _slab(axis: Tensor, half: float) -> list[Solid]:
    return [plane(axis, half), plane(-axis, half)]


def _frame(width: float, depth: float) -> Solid:
    return Intersection([*_slab(_X, width / 2), *_slab(_Y, depth / 2)])


def _through(start: Tensor, end: Tensor, slope: float) -> Surface:
    """Wall through two points of the plane z = 0 of a counter-clockwise outline, leaning inwards above it."""
    along = end - start
    normal = torch.stack([along[1], -along[0], along.norm() / slope])
    return plane(normal, float(normal @ start / normal.norm()))


def _polygon(sides: int, radius: float) -> list[tuple[float, float]]:
    return [
        (radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides)) for i in range(sides)
    ]


def _spin(share: float) -> Tensor:
    return torch.tensor([math.cos(2 * math.pi * share), math.sin(2 * math.pi * share), 0.0], dtype=torch.float64)


def _turn(share: float) -> Tensor:
    """Rotation about z by a share of a full turn."""
    x, y, _ = _spin(share).tolist()
    return torch.tensor([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)


def _tilted(degrees: float) -> Tensor:
    """Rotation that tilts the z axis towards x."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def _frame_of(axis: Tensor) -> Tensor:
    """Rotation that takes z to ``axis``."""
    other = torch.linalg.cross(axis, _X if axis[0].abs() < 0.8 else _Y)
    other = other / other.norm()
    return torch.stack([other, torch.linalg.cross(axis, other), axis], 1)
