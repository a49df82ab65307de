"""Shapes with the number of faces that was asked for."""

from collections.abc import Callable

from torch import Generator, Tensor

from dnf_pyg.synthetic.shapes import Shape

__all__ = ["sized_shape"]


def sized_shape(
    shape: Shape,
    seed: int,
    num_faces: int,
    max_tries: int = 6,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Tensor, Tensor]:
    """Make a shape again until it has the wanted number of faces within 8%, or as near as it comes.

    Kinds of shapes take their number of faces for a rough guide: the area of a solid is estimated before it is meshed.
    Which solids have details too small to be meshed depends on that number, so the one of the second try is kept.

    Args:
        shape: One of :data:`~dnf_pyg.synthetic.shapes.SHAPES`.
        seed: Seed of its details, the same in every try.
        num_faces: Number of faces wanted.
        max_tries: Number of times it is made, at most.
        progress: Called with the number of times it was made and their maximum.

    Returns:
        Vertex positions (V, 3) and faces (3, F).

    Example:
        >>> from dnf_pyg.synthetic.shapes import SHAPES
        >>> pos, face = sized_shape(SHAPES["blob"], 0, 1000)
        >>> abs(face.size(1) - 1000) <= 80
        True
    """
    asked, best = float(num_faces), None
    places: dict[str, Tensor] = {}
    for number in range(max_tries):
        progress(number, max_tries)
        pos, face = shape(Generator().manual_seed(seed), max(4, round(asked)), places if number else None)
        found = face.size(1)
        if best is None or abs(found - num_faces) < abs(best[1].size(1) - num_faces):
            best = pos, face
        if abs(found - num_faces) <= 0.08 * num_faces:
            break
        asked *= num_faces / found
    assert best is not None
    return best
