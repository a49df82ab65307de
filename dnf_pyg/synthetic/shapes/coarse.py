"""Bodies triangulated as CAD programs export them: few, long triangles with all vertices on sharp edges."""

import math

import torch
from torch import Tensor

from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["coarse"]


def coarse(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Prisms, cones, frustums, turned parts and extruded outlines without any remeshing."""
    num_rings = dice.choice([1, 2, 2, 2, 3, 4, 6])
    sides = max(3, num_faces // (2 * num_rings))
    height = dice.uniform(0.1, 3.0)
    outline = _outline(dice, sides)  # (S, 2)
    levels = [height * i / max(num_rings - 1, 1) for i in range(num_rings)]
    scales = [1.0] + [dice.choice([1.0, dice.uniform(0.5, 1.0)]) for _ in levels[1:]]
    rings = [
        torch.cat([scale * outline, torch.full((sides, 1), z)], 1) for z, scale in zip(levels, scales, strict=True)
    ]
    ends = torch.tensor([[0.0, 0, 0], [0, 0, levels[-1] if num_rings > 1 else height]], dtype=torch.float64)
    pos = torch.cat([*rings, ends])
    this, following = torch.arange(sides), (torch.arange(sides) + 1) % sides
    low, high = pos.size(0) - 2, pos.size(0) - 1
    parts = [torch.stack([following, this, torch.full_like(this, low)])]
    for start in range(0, (num_rings - 1) * sides, sides):
        a, b, c, d = this + start, following + start, following + start + sides, this + start + sides
        parts += [torch.stack([a, b, c]), torch.stack([a, c, d])]
    last = (num_rings - 1) * sides
    parts.append(torch.stack([this + last, following + last, torch.full_like(this, high)]))
    return pos @ dice.rotation().t(), torch.cat(parts, 1)


def _outline(dice: Dice, sides: int) -> Tensor:
    """Corners (S, 2) of a counter-clockwise outline that can be seen from the origin: round, toothed or wavy."""
    angle = 2 * math.pi * torch.arange(sides, dtype=torch.float64) / sides
    teeth, depth = dice.integer(3, max(3, min(24, sides // 4))), dice.uniform(0.1, 0.4)
    radius = dice.choice(
        [
            lambda: torch.ones_like(angle),
            lambda: 1 - depth * (torch.sin(teeth * angle) > 0).double(),
            lambda: 1 - depth * torch.sin(teeth * angle).square(),
        ]
    )()
    stretch = torch.tensor([1.0, dice.uniform(0.3, 1.0)], dtype=torch.float64)
    return radius[:, None] * torch.stack([angle.cos(), angle.sin()], 1) * stretch
