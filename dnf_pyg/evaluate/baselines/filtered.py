"""What every classical filter takes and gives."""

from typing import NamedTuple, Protocol

from torch import Tensor

__all__ = ["Baseline", "FilteredMesh"]


class FilteredMesh(NamedTuple):
    """Result of a classical filter.

    Attributes:
        pos: Denoised vertex positions, (V, 3).
        normal: Filtered facet normals, (F, 3), unit length, that the vertices were moved to fit last.
    """

    pos: Tensor
    normal: Tensor


class Baseline(Protocol):
    """A filter whose parameters are its fields; every one has a default, and its repr shows them all."""

    def __call__(self, pos: Tensor, face: Tensor) -> FilteredMesh:
        """Denoise vertex positions (V, 3) of a mesh with faces (3, F)."""
        ...
