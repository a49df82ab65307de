"""Random rotation of patches."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

from dnf_pyg.patches.rotation import random_rotations, rotate_patches

__all__ = ["RandomRotation"]


class RandomRotation(BaseTransform):
    """Rotate ``x``, ``y``, ``pos`` and ``earlier`` by one random rotation, uniform over all rotations.

    Source: Li et al. 2020, Sec. 3.5 (data augmentation).
    Differs: the authors' code rotates about the z axis only.

    Args:
        generator: Source of randomness; the default of torch if not given.

    Example:
        >>> data = RandomRotation()(Data(x=torch.tensor([[0.0, 0, 1]])))
        >>> bool(torch.isclose(data.x.norm(), torch.tensor(1.0)))
        True
    """

    def __init__(self, generator: torch.Generator | None = None) -> None:
        self.generator = generator

    def forward(self, data: Data) -> Data:
        """Rotate a patch."""
        return rotate_patches(data, random_rotations(1, self.generator))

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"
