"""Surfaces and convex parts that solids are built from; lengths in model units, axes along z."""

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from dnf_pyg.synthetic.shapes.solid import Intersection, Solid, Surface

__all__ = ["ball", "blend", "box", "cone", "cylinder", "ellipsoid", "plane", "prism", "rod", "rounded_box", "torus"]


def plane(normal: Sequence[float] | Tensor, offset: float) -> Surface:
    """Half space ``normal . x < offset``; ``normal`` is brought to unit length."""
    unit = torch.as_tensor(normal, dtype=torch.float64)
    unit = unit / unit.norm()
    return Surface(lambda pos: pos @ unit - offset)


def ball(radius: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Surface:
    """Ball."""
    middle = torch.tensor(centre, dtype=torch.float64)
    return Surface(lambda pos: (pos - middle).norm(dim=1) - radius)


def ellipsoid(radii: Sequence[float]) -> Surface:
    """Ellipsoid about the origin; the field is a first-order distance."""
    inverse = 1 / torch.tensor(radii, dtype=torch.float64)

    def field(pos: Tensor) -> Tensor:
        scaled = (pos * inverse).norm(dim=1).clamp(min=1e-9)
        return scaled * (scaled - 1) / (pos * inverse.square()).norm(dim=1).clamp(min=1e-9)

    return Surface(field)


def torus(ring: float, tube: float) -> Surface:
    """Torus about the z axis."""
    return Surface(lambda pos: torch.hypot(_radius(pos) - ring, pos[:, 2]) - tube)


def cylinder(radius: float) -> Surface:
    """Endless cylinder about the z axis."""
    return Surface(lambda pos: _radius(pos) - radius)


def cone(radius: float, slope: float) -> Surface:
    """Endless cone about the z axis: its radius is ``radius`` at z = 0 and shrinks by ``slope`` per unit of z."""
    length = math.hypot(1.0, slope)
    return Surface(lambda pos: (_radius(pos) - radius + slope * pos[:, 2]) / length)


def rod(radius: float, low: float, high: float) -> Solid:
    """Cylinder about the z axis between two planes."""
    return Intersection([cylinder(radius), plane((0, 0, 1), high), plane((0, 0, -1), -low)])


def box(size: Sequence[float]) -> Solid:
    """Box about the origin with edges of length ``size``."""
    axes = torch.eye(3, dtype=torch.float64)
    return Intersection([plane(sign * axes[i], size[i] / 2) for i in range(3) for sign in (1, -1)])


def prism(corners: Sequence[tuple[float, float]], low: float, high: float) -> Solid:
    """Convex polygon with counter-clockwise corners in the xy plane, swept from ``low`` to ``high`` along z.

    Example:
        >>> value, _ = prism([(0, 0), (1, 0), (0, 1)], 0, 2).evaluate(torch.tensor([[0.2, 0.2, 1], [2, 2, 1]]).double())
        >>> (value < 0).tolist()
        [True, False]
    """
    parts: list[Solid] = [plane((0, 0, 1), high), plane((0, 0, -1), -low)]
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        length = math.hypot(x1 - x0, y1 - y0)
        parts.append(plane((y1 - y0, x0 - x1, 0), ((y1 - y0) * x0 + (x0 - x1) * y0) / length))
    return Intersection(parts)


def rounded_box(size: Sequence[float], radius: float) -> Surface:
    """Box whose edges and corners are rounded with ``radius``: one smooth surface."""
    half = torch.tensor(size, dtype=torch.float64) / 2 - radius

    def field(pos: Tensor) -> Tensor:
        excess = pos.abs() - half
        outside = (excess.clamp(min=0).square().sum(1) + 1e-24).sqrt()
        return outside + excess.amax(1).clamp(max=0) - radius

    return Surface(field)


def blend(first: Surface, second: Surface, radius: float) -> Surface:
    """Union of two half spaces whose inner edge is filled by a smooth fillet of about ``radius``.

    For the rounded intersection use ``~blend(~a, ~b, radius)``. Source: Quilez, polynomial smooth minimum.
    """

    def field(pos: Tensor) -> Tensor:
        one, two = first.field(pos), second.field(pos)
        mix = (radius - (one - two).abs()).clamp(min=0) / radius
        return torch.minimum(one, two) - mix.square() * radius / 4

    return Surface(field)


def _radius(pos: Tensor) -> Tensor:
    return (pos[:, :2].square().sum(1) + 1e-24).sqrt()
