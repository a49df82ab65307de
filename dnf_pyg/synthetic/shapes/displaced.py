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
    size = (num_faces / 20) ** 0.5
    sphere = trimesh.creation.icosahedron()
    vertices, faces = trimesh.remesh.subdivide_to_size(sphere.vertices, sphere.faces, 1.06 / size, max_iter=12)
    sphere = trimesh.Trimesh(vertices, faces)
    face = torch.tensor(sphere.faces).t().contiguous()
    unit = torch.nn.functional.normalize(torch.tensor(sphere.vertices), dim=1)
    waves = torch.stack([dice.direction() * dice.uniform(0.5, 1.5) * frequency for _ in range(num_waves)], dim=1)
    phase = torch.tensor([dice.uniform(0.0, 6.28) for _ in range(num_waves)], dtype=torch.float64)
    radius = 1 + height * torch.sin(unit @ waves + phase).mean(dim=1) * num_waves**0.5
    return unit * radius[:, None], face
