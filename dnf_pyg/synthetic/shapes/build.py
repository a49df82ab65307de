"""From a solid to a clean mesh of about the wanted number of faces, in one of several styles of triangulation."""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from dnf_pyg.errors import OptionError
from dnf_pyg.synthetic.shapes.contour import LabelledMesh, contour
from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.remesh import remesh, shake
from dnf_pyg.synthetic.shapes.solid import Solid

__all__ = ["STYLES", "build", "build_recipe", "even", "graded", "shaken", "sparse", "stretched"]

Style = Callable[[Solid, LabelledMesh, float, Dice], LabelledMesh]

_TOLERANCE = 0.2  # how far a corner may reach past a side too small for the grid, in edge lengths
_MOST_DRAWS = 100  # of a solid; at 1,500 faces, one gear in nine is without details that are too small
_HALF = 1.8  # solids are made inside the cube [-1.8, 1.8]^3


def build(solid: Solid, num_faces: int, dice: Dice, style: Style | None = None) -> LabelledMesh | None:
    """Mesh a solid; None where it has details too small for the wanted number of faces.

    Args:
        solid: Solid inside the cube from -1.8 to 1.8.
        num_faces: About the number of faces wanted.
        dice: Source of randomness.
        style: Triangulation; a random one of :data:`STYLES` where not given.
    """
    low, high, area = _extent(solid)
    size = math.sqrt(area * 4 / (math.sqrt(3) * num_faces))
    if not size or (high - low).min() < 2 * size:
        return None
    start = contour(solid, low, high, 0.9 * size)
    if not len(start.pos) or solid.evaluate(start.pos)[0].abs().max() > _TOLERANCE * size:
        return None
    mesh = (style or dice.choice(STYLES))(solid, start, size, dice)
    return mesh if _is_clean(solid, mesh) else None


def build_recipe(recipe: Callable[[Dice], Solid], num_faces: int, dice: Dice) -> LabelledMesh:
    """Mesh a random solid in a random direction; draw another where details are too small for the number of faces.

    Args:
        recipe: Draws a solid inside the cube from -1 to 1 or a little beyond.
        num_faces: About the number of faces wanted.
        dice: Source of randomness.

    Raises:
        OptionError: If none of 100 solids can be meshed.
    """
    for _ in range(_MOST_DRAWS):
        place = dice.mark("solid")
        mesh = build(recipe(dice).move(dice.rotation()), num_faces, dice)
        if mesh is not None:
            dice.keep("solid", place)
            return mesh
    raise OptionError(
        f"Expected enough faces for the details of the shape (got {num_faces}, too few for {_MOST_DRAWS} solids drawn)."
        " Ask for more, or for another kind."
    )


def even(solid: Solid, start: LabelledMesh, size: float, dice: Dice) -> LabelledMesh:
    """Nearly equilateral triangles of one size."""
    return remesh(solid, start, size, generator=dice.generator)


def graded(solid: Solid, start: LabelledMesh, size: float, dice: Dice) -> LabelledMesh:
    """Triangles whose size varies slowly over the solid, by a factor of about 3."""
    wave, phase = 2.5 * dice.normal(3, 3), dice.normal(3)

    def wanted(pos: Tensor) -> Tensor:
        return size * (0.25 * torch.sin(pos @ wave + phase).sum(1)).exp()

    return remesh(solid, start, wanted, generator=dice.generator)


def shaken(solid: Solid, start: LabelledMesh, size: float, dice: Dice) -> LabelledMesh:
    """Irregular triangles: vertices of an even mesh moved along the surface at random."""
    mesh = remesh(solid, start, size, generator=dice.generator)
    return shake(solid, mesh, dice.uniform(0.15, 0.35) * size, dice.generator)


def sparse(solid: Solid, start: LabelledMesh, size: float, dice: Dice) -> LabelledMesh:
    """Triangles of very different sizes and shapes, as decimation leaves them: a finer mesh thinned at random."""
    wave, phase = 8 / size**0.25 * dice.normal(3, 3), dice.normal(3)

    def wanted(pos: Tensor) -> Tensor:
        return size * (0.2 * torch.sin(pos @ wave + phase).sum(1)).exp() * 0.95

    mesh = remesh(solid, start, 0.6 * size, num_rounds=2, generator=dice.generator)
    return remesh(solid, mesh, wanted, num_rounds=2, relaxation=0.0, generator=dice.generator)


def stretched(solid: Solid, start: LabelledMesh, size: float, dice: Dice) -> LabelledMesh:
    """Triangles elongated along one direction by a factor of 1.5 to 2.5."""
    along, factor = dice.direction(), dice.uniform(1.5, 2.5)
    shape = torch.eye(3, dtype=torch.float64) + (factor - 1) * torch.outer(along, along)
    squeezed = solid.map(lambda pos: pos @ shape)
    start = start._replace(pos=start.pos @ shape.inverse())
    mesh = remesh(squeezed, start, size / factor**0.33, generator=dice.generator)
    return mesh._replace(pos=mesh.pos @ shape)


STYLES: tuple[Style, ...] = (even, graded, shaken, sparse, stretched)


def _extent(solid: Solid, num: int = 49) -> tuple[Tensor, Tensor, float]:
    """Box around the solid with a margin, and its surface area by the crossings of a coarse grid (Cauchy-Crofton)."""
    axis = torch.linspace(-_HALF, _HALF, num, dtype=torch.float64)
    grid = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), -1)
    inside = torch.cat([solid.evaluate(chunk)[0] < 0 for chunk in grid.view(-1, 3).split(65536)]).view(num, num, num)
    if not inside.any():
        return axis.new_zeros(3), axis.new_zeros(3), 0.0
    spacing = float(axis[1] - axis[0])
    crossings = sum(int(inside.diff(dim=axis).sum()) for axis in range(3))
    return grid[inside].amin(0) - 1.5 * spacing, grid[inside].amax(0) + 1.5 * spacing, crossings * spacing**2 / 1.5


def _is_clean(solid: Solid, mesh: LabelledMesh) -> bool:
    """No face turned away from its surface, and few that lie much aslant on a curved one."""
    corner = mesh.pos[mesh.face]
    cross = torch.linalg.cross(corner[1] - corner[0], corner[2] - corner[0])
    agreement = torch.cosine_similarity(cross, solid.normals(corner.mean(0), mesh.label))
    return bool(agreement.min() > 0.7 and (agreement < math.cos(math.radians(12))).double().mean() < 0.005)
