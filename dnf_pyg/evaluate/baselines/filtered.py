"""Interface of the classical filters."""

from typing import NamedTuple, Protocol

from torch import Tensor

__all__ = ["Baseline", "FilteredMesh"]


class FilteredMesh(NamedTuple):
    """Result of a classical filter.

    Attributes:
        pos: Denoised vertex positions, (V, 3).
        normal: Filtered facet normals, (F, 3), unit length, which the vertices were last moved to fit.
    """

    pos: Tensor
    normal: Tensor


class Baseline(Protocol):
    """A filter, a dataclass whose parameters all have defaults."""

    def __call__(self, pos: Tensor, face: Tensor) -> FilteredMesh:
        """Denoise vertex positions (V, 3) of a mesh with faces (3, F)."""
        ...
