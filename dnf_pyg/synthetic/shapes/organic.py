"""Random bodies without sharp edges, smooth or covered with fine detail, as statues and animals have it."""

import torch

from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.primitives import ball, blend, ellipsoid, rounded_box, torus
from dnf_pyg.synthetic.shapes.solid import Field, Solid, Surface

__all__ = ["grooved", "knot", "limbs", "pebble", "rough", "woven"]


def pebble(dice: Dice) -> Solid:
    """Rounded bodies grown together."""
    return _trunk(dice)


def limbs(dice: Dice) -> Solid:
    """Body with limbs and heads: blended chains of shrinking balls."""
    body = _trunk(dice, 0.6)
    for _ in range(dice.integer(2, 6)):
        place, heading, radius = torch.zeros(3, dtype=torch.float64), dice.direction(), dice.uniform(0.2, 0.35)
        for _ in range(dice.integer(3, 6)):
            heading = torch.nn.functional.normalize(heading + 0.4 * dice.normal(3), dim=0)
            place = place + 0.8 * radius * heading + 0.2 * heading
            if place.norm() > 1.3:
                break
            body = blend(body, ball(radius, place.tolist()), 0.25)
            radius = radius * dice.uniform(0.75, 1.05)
    return body


def rough(dice: Dice) -> Solid:
    """Body with waves of many lengths; the shorter, the lower."""
    waves = [_waves(dice, 8, frequency) for frequency in (3.0, 6.0, 12.0, 24.0)]
    height = dice.uniform(0.03, 0.07)
    return _displace(
        _trunk(dice), lambda pos: height * torch.stack([0.5**i * wave(pos) for i, wave in enumerate(waves)]).sum(0)
    )


def grooved(dice: Dice) -> Solid:
    """Body with grooves between round ridges that wander over it, like hair or folds."""
    wander, count, height = _waves(dice, 5, 2.0), dice.uniform(8, 20), dice.uniform(0.02, 0.05)
    axis = dice.direction()
    return _displace(
        _trunk(dice), lambda pos: height * (torch.sin(count * (pos @ axis) + 1.5 * wander(pos)).square() - 0.5)
    )


def woven(dice: Dice) -> Solid:
    """Body with two crossing families of bumps, like scales or fabric."""
    one, two, count, height = dice.direction(), dice.direction(), dice.uniform(8, 18), dice.uniform(0.03, 0.06)
    return _displace(_trunk(dice), lambda pos: height * torch.sin(count * (pos @ one)) * torch.sin(count * (pos @ two)))


def knot(dice: Dice) -> Solid:
    """Interlocked or merged rings of round or wavy section."""
    body = torus(dice.uniform(0.7, 0.9), dice.uniform(0.2, 0.35))
    for _ in range(dice.integer(0, 2)):
        ring = torus(dice.uniform(0.5, 0.8), dice.uniform(0.12, 0.25)).map(_placing(dice, 0.5))
        body = blend(body, ring, 0.15)
    wave, height = _waves(dice, 6, dice.uniform(3.0, 8.0)), dice.uniform(0.0, 0.05)
    return _displace(body, lambda pos: height * wave(pos))


def _trunk(dice: Dice, scale: float = 1.0) -> Surface:
    """Two to five rounded parts, blended."""
    body = ellipsoid([scale * dice.uniform(0.5, 1.0) for _ in range(3)])
    for _ in range(dice.integer(1, 4)):
        radii = [scale * dice.uniform(0.3, 0.7) for _ in range(3)]
        part = rounded_box([2 * r for r in radii], 0.6 * min(radii)) if dice.chance(0.3) else ellipsoid(radii)
        body = blend(body, part.map(_placing(dice, 0.7 * scale)), 0.3 * scale)
    return body


def _placing(dice: Dice, distance: float) -> Field:
    """Inverse of a random rigid motion by up to ``distance``, as :meth:`Solid.map` takes it."""
    turn, shift = dice.rotation(), distance * dice.uniform(0.3, 1.0) * dice.direction()
    return lambda pos: (pos - shift) @ turn


def _waves(dice: Dice, count: int, frequency: float) -> Field:
    """Sum of plane waves of unit variance, of about the given angular frequency in all directions."""
    wave = torch.stack([frequency * dice.uniform(0.7, 1.4) * dice.direction() for _ in range(count)], 1)
    phase = 6.3 * torch.tensor([dice.uniform(0, 1) for _ in range(count)], dtype=torch.float64)
    return lambda pos: torch.sin(pos @ wave + phase).sum(1) * (2 / count) ** 0.5


def _displace(body: Surface, height: Field) -> Surface:
    """The surface moved outwards by a height that depends on the place."""
    return Surface(lambda pos: body.field(pos) - height(pos))
