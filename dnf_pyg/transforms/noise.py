"""Noise on the vertices of a mesh."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

from dnf_pyg.mesh.noise import Noise

__all__ = ["AddNoise"]


class AddNoise(BaseTransform):
    """Add noise to the vertices ``pos`` of a mesh and keep the clean ones as ``clean_pos``.

    The transforms that make facet graphs and patches take their targets ``y`` from ``clean_pos``.

    Args:
        noise: Noise model.
        low: Smallest noise level, multiples of the mean edge length.
        high: Largest noise level; each mesh draws its own from this range.
        generator: Source of randomness; the default of torch if not given.

    Raises:
        ValueError: If not ``0 <= low <= high``.

    Example:
        >>> from dnf_pyg.mesh.noise import GaussianNoise
        >>> data = Data(pos=torch.eye(3), face=torch.tensor([[0], [1], [2]]))
        >>> AddNoise(GaussianNoise(), low=0.1, high=0.3)(data)
        Data(pos=[3, 3], face=[3, 1], clean_pos=[3, 3])
    """

    def __init__(self, noise: Noise, low: float, high: float, generator: torch.Generator | None = None) -> None:
        if not 0 <= low <= high:
            raise ValueError(f"Expected 0 <= 'low' <= 'high' (got {low} and {high}). Put the smaller level first.")
        self.noise = noise
        self.low = low
        self.high = high
        self.generator = generator

    def forward(self, data: Data) -> Data:
        """Add noise to a mesh."""
        share = float(torch.rand((), generator=self.generator, device="cpu"))
        level = self.low + (self.high - self.low) * share
        data.clean_pos = data.pos
        data.pos = self.noise(data.pos, data.face, level, self.generator)
        return data

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.noise!r}, low={self.low}, high={self.high})"
