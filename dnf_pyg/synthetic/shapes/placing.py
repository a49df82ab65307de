"""Directions, rotations and outlines for the recipes of solids."""

import math

import torch
from torch import Tensor

from dnf_pyg.synthetic.shapes.primitives import plane
from dnf_pyg.synthetic.shapes.solid import Intersection, Solid, Surface

__all__ = [
    "LYING",
    "UPRIGHT",
    "X_AXIS",
    "Y_AXIS",
    "Z_AXIS",
    "axis_frame",
    "leaf",
    "regular_polygon",
    "slab",
    "spin",
    "tilted",
    "tube",
    "turned",
    "wall_through",
]

X_AXIS, Y_AXIS, Z_AXIS = torch.eye(3, dtype=torch.float64)
UPRIGHT = torch.eye(3, dtype=torch.float64)  # turns nothing
LYING = torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=torch.float64)  # turns the z axis to x


def leaf(solid: Solid) -> Surface:
    """Return the surface of a solid that has only one."""
    (surface,) = solid.surfaces
    return surface


def slab(axis: Tensor, half: float) -> list[Solid]:
    """The two sides of a slab about the origin, square to an axis."""
    return [plane(axis, half), plane(-axis, half)]


def tube(width: float, depth: float) -> Solid:
    """Upright tube of rectangular section, endless."""
    return Intersection([*slab(X_AXIS, width / 2), *slab(Y_AXIS, depth / 2)])


def wall_through(start: Tensor, end: Tensor, slope: float) -> Surface:
    """Wall through two points of the plane z = 0 of a counter-clockwise outline, leaning inwards above it."""
    along = end - start
    normal = torch.stack([along[1], -along[0], along.norm() / slope])
    return plane(normal, float(normal @ start / normal.norm()))


def regular_polygon(sides: int, radius: float) -> list[tuple[float, float]]:
    """Corners (x, y) of a regular polygon about the origin, counter-clockwise."""
    return [
        (radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides)) for i in range(sides)
    ]


def spin(share: float) -> Tensor:
    """Unit vector (3) in the plane z = 0, a share of a full turn from the x axis."""
    return torch.tensor([math.cos(2 * math.pi * share), math.sin(2 * math.pi * share), 0.0], dtype=torch.float64)


def turned(share: float) -> Tensor:
    """Rotation about z by a share of a full turn."""
    x, y, _ = spin(share).tolist()
    return torch.tensor([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)


def tilted(degrees: float) -> Tensor:
    """Rotation that tilts the z axis towards x."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def axis_frame(axis: Tensor) -> Tensor:
    """Rotation that takes z to ``axis``."""
    other = torch.linalg.cross(axis, X_AXIS if axis[0].abs() < 0.8 else Y_AXIS)
    other = other / other.norm()
    return torch.stack([other, torch.linalg.cross(axis, other), axis], 1)
