"""Thin bodies: two sheets a few edges apart, flat, bent or creased, with a rim between them."""

import math

import torch
from torch import Tensor

from dnf_pyg.mesh.adjacency import boundary_vertices
from dnf_pyg.mesh.geometry import vertex_normals
from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["thin"]


def thin(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Plate, fin or curved shell of a thickness of 1 to 3 edges."""
    ratio = dice.uniform(0.3, 1.0)
    width = max(4, round(math.sqrt(num_faces / 4 / ratio)))
    depth = max(4, round(ratio * width))
    row, column = torch.meshgrid(torch.arange(depth + 1), torch.arange(width + 1), indexing="ij")
    flat = torch.stack([column, row], -1).view(-1, 2).double()
    corner = ((width + 1) * row + column)[:-1, :-1].flatten()
    right, above = corner + 1, corner + width + 1
    face = torch.cat([torch.stack([corner, right, above + 1]), torch.stack([corner, above + 1, above])], 1)
    inside = ~boundary_vertices(face, len(flat))
    flat[inside] += (0.15 * dice.normal(len(flat), 2).clamp(-2, 2))[inside]
    sheet = _bend(dice, flat, float(width))
    offset = 0.5 * dice.uniform(1.0, 3.0) * vertex_normals(sheet, face)
    rim = _boundary(face)
    top, bottom = rim, rim + len(flat)
    walls = [torch.stack([top[1], top[0], bottom[0]]), torch.stack([top[1], bottom[0], bottom[1]])]
    pos = torch.cat([sheet + offset, sheet - offset])
    return pos @ dice.rotation().t() / width, torch.cat([face, face.flip(0) + len(flat), *walls], 1)


def _bend(dice: Dice, flat: Tensor, width: float) -> Tensor:
    """Place points of the plane (P, 2) on a plane, a cylinder, a wavy surface or two planes that meet in a crease."""
    x, y = flat.unbind(1)
    turn, wave, phase = dice.uniform(0.5, 4.0), dice.uniform(1.0, 3.0), dice.uniform(0, 6.3)
    crease = width * dice.uniform(0.3, 0.7)
    tilt = dice.uniform(-1.0, 1.0)
    return dice.choice(
        [
            lambda: torch.stack([x, y, torch.zeros_like(x)], 1),
            lambda: torch.stack(
                [width / turn * torch.sin(turn * x / width), y, width / turn * torch.cos(turn * x / width)], 1
            ),
            lambda: torch.stack([x, y, 0.08 * width * torch.sin(6.3 * wave * (x + 0.4 * y) / width + phase)], 1),
            lambda: torch.stack([x, y, tilt * (x - crease).clamp(min=0)], 1),
        ]
    )()


def _boundary(face: Tensor) -> Tensor:
    """Directed edges (2, B) that only one face has."""
    edge = torch.cat([face[[0, 1]], face[[1, 2]], face[[2, 0]]], 1)
    code = edge.min(0).values * (int(face.max()) + 1) + edge.max(0).values
    _, inverse, count = code.unique(return_inverse=True, return_counts=True)
    return edge[:, count[inverse] == 1]
