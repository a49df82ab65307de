"""Smooth and bumpy shapes: spheres whose radius waves."""

import torch
import trimesh
from torch import Tensor

from dnf_pyg.synthetic.shapes.dice import Dice

__all__ = ["blob", "bumpy"]


def blob(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Smooth closed shape: a few long waves."""
    return _sphere(dice, num_faces, num_waves=6, frequency=2.0, height=0.25)


def bumpy(dice: Dice, num_faces: int) -> tuple[Tensor, Tensor]:
    """Closed shape with many small bumps."""
    return _sphere(dice, num_faces, num_waves=12, frequency=7.0, height=0.12)


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
