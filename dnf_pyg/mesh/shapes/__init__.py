"""Clean meshes made in code: CAD-like with sharp edges, smooth, bumpy; the same generator gives the same mesh."""

from collections.abc import Callable

from torch import Generator, Tensor

from dnf_pyg.mesh.shapes import cad, displaced
from dnf_pyg.mesh.shapes.build import build
from dnf_pyg.mesh.shapes.dice import Dice
from dnf_pyg.mesh.shapes.solid import Solid

__all__ = ["SHAPES"]

Shape = Callable[[Generator, int], tuple[Tensor, Tensor]]


def _from_solid(recipe: Callable[[Dice], Solid]) -> Shape:
    def make(generator: Generator, num_faces: int) -> tuple[Tensor, Tensor]:
        dice = Dice(generator)
        while True:  # a recipe may draw details too small for the wanted number of faces
            mesh = build(recipe(dice).move(dice.rotation()), num_faces, dice)
            if mesh is not None:
                return mesh.pos, mesh.face

    return make


def _from_mesh(recipe: Callable[[Dice, int], tuple[Tensor, Tensor]]) -> Shape:
    return lambda generator, num_faces: recipe(Dice(generator), num_faces)


SHAPES: dict[str, Shape] = {
    **{name: _from_solid(getattr(cad, name)) for name in cad.__all__},
    **{name: _from_mesh(getattr(displaced, name)) for name in displaced.__all__},
}
