"""Shapes whose vertices are displaced by waves: smooth and bumpy spheres, and solids under fine relief."""

import math

import torch
import trimesh
from torch import Tensor

from dnf_pyg.mesh.geometry import mean_edge_length, vertex_normals
from dnf_pyg.synthetic.shapes import cad, organic, sculpted
from dnf_pyg.synthetic.shapes.build import build_recipe
from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["blob", "bumpy", "relief"]

_SOLIDS = [getattr(group, name) for group in (cad, sculpted, organic) for name in group.__all__]


def blob(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Smooth closed shape: a few long waves."""
    return _sphere(dice, num_faces, num_waves=6, frequency=2.0, height=0.25)


def bumpy(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Closed shape with many small bumps."""
    return _sphere(dice, num_faces, num_waves=12, frequency=7.0, height=0.12)


def relief(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Any solid under relief with wavelengths of 3 to 12 edges, as engraving, fur or fabric have it."""
    mesh = build_recipe(dice.choice(_SOLIDS), num_faces, dice)
    wavelength = dice.uniform(3.0, 9.0) * float(mean_edge_length(mesh.pos, mesh.face))
    count, slope = dice.integer(3, 12), dice.uniform(0.1, 0.5)
    waves = torch.stack([dice.direction() / dice.uniform(1.0, 1.33) for _ in range(count)], dim=1)
    phase = 2 * math.pi * torch.tensor([dice.uniform(0, 1) for _ in range(count)], dtype=torch.float64)
    height = torch.sin(2 * math.pi / wavelength * mesh.pos @ waves + phase).sum(dim=1) * (2 / count) ** 0.5
    amplitude = slope * wavelength / (2 * math.pi)
    return mesh.pos + amplitude * height[:, None] * vertex_normals(mesh.pos, mesh.face), mesh.face


def _sphere(dice: Dice, num_faces: int, num_waves: int, frequency: float, height: float) -> tuple[Tensor, Tensor]:
    unit, face = _geodesic_sphere(max(1, round((num_faces / 20) ** 0.5)))
    waves = torch.stack([dice.direction() * dice.uniform(0.5, 1.5) * frequency for _ in range(num_waves)], dim=1)
    phase = torch.tensor([dice.uniform(0.0, 6.28) for _ in range(num_waves)], dtype=torch.float64)
    radius = 1 + height * torch.sin(unit @ waves + phase).mean(dim=1) * num_waves**0.5
    return unit * radius[:, None], face


def _geodesic_sphere(frequency: int) -> tuple[Tensor, Tensor]:
    """Icosahedron with each side split into ``frequency`` squared triangles, its vertices on the unit sphere."""
    solid = trimesh.creation.icosahedron()
    grid = torch.tensor([(i, j) for i in range(frequency + 1) for j in range(frequency + 1 - i)])
    place = torch.zeros(frequency + 1, frequency + 1, dtype=torch.long)
    place[tuple(grid.t())] = torch.arange(len(grid))
    share = torch.cat([frequency - grid.sum(dim=1, keepdim=True), grid], dim=1).double() / frequency
    pos = share @ torch.tensor(solid.vertices)[torch.tensor(solid.faces)]  # (20, P, 3): sides share their rims
    (a, b), (c, d) = (grid[grid.sum(dim=1) < limit].t() for limit in (frequency, frequency - 1))
    upward = torch.stack([place[a, b], place[a + 1, b], place[a, b + 1]])
    downward = torch.stack([place[c + 1, d], place[c + 1, d + 1], place[c, d + 1]])
    split = torch.cat([upward, downward], dim=1)
    face = (split[:, None, :] + len(grid) * torch.arange(20)[:, None]).flatten(1)
    rounded, vertex_id = (pos.flatten(0, 1) * 2**30).round().unique(dim=0, return_inverse=True)
    return torch.nn.functional.normalize(rounded, dim=1), vertex_id[face]
