"""Clean meshes made in code: parts with sharp edges, smooth and bumpy bodies; a generator determines the mesh."""

from collections.abc import Callable
from typing import Protocol

from torch import Generator, Tensor

from dnf_pyg.synthetic.shapes import cad, coarse, displaced, organic, sculpted, sheets
from dnf_pyg.synthetic.shapes.build import build_recipe
from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.solid import Solid

__all__ = ["SHAPES"]

Mesh = tuple[Tensor, Tensor]


class Shape(Protocol):
    """A kind of shape."""

    def __call__(self, generator: Generator, num_faces: int, places: dict[str, Tensor] | None = None, /) -> Mesh:
        """Make one of about ``num_faces`` faces; with the ``places`` of another, the same solid."""


def _from_solid(recipe: Callable[[Dice], Solid]) -> Shape:
    def make(dice: Dice, num_faces: int) -> Mesh:
        mesh = build_recipe(recipe, num_faces, dice)
        return _cut_open(mesh.pos, mesh.face, dice) if dice.chance(0.15) else (mesh.pos, mesh.face)

    return _from_mesh(make)


def _cut_open(pos: Tensor, face: Tensor, dice: Dice) -> Mesh:
    """Remove the faces beyond a plane, a tenth to a third of them, so that the mesh has a boundary."""
    height = pos[face].mean(0) @ dice.direction()
    kept = face[:, height < height.quantile(dice.uniform(0.67, 0.9))]
    used, face = kept.unique(return_inverse=True)
    return pos[used], face


def _from_mesh(recipe: Callable[[Dice, int], Mesh]) -> Shape:
    return lambda generator, num_faces, places=None: recipe(Dice(generator, places), num_faces)


SHAPES: dict[str, Shape] = {
    **{name: _from_solid(getattr(group, name)) for group in (cad, sculpted, organic) for name in group.__all__},
    **{name: _from_mesh(getattr(group, name)) for group in (displaced, coarse, sheets) for name in group.__all__},
}
"""Kinds of shapes by name: functions of a generator and an approximate number of faces, to ``pos`` and ``face``."""
