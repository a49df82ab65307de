"""Random jitter of facet normals."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

__all__ = ["JitterNormal"]


class JitterNormal(BaseTransform):
    """Add clipped Gaussian noise to the facet normals ``x`` and scale them back to unit length.

    Source: Li et al. 2020, Sec. 3.5 (data augmentation); the size of the noise is that of the authors' code.
    Differs: the authors' code jitters a normal anew for every face that it is a neighbour of, and keeps the lengths.

    Args:
        sigma: Standard deviation, per coordinate of the unit normal.
        clip: Largest noise, per coordinate.
        generator: Source of randomness; the default of torch if not given.

    Raises:
        ValueError: If ``sigma`` or ``clip`` is negative.

    Example:
        >>> data = JitterNormal(sigma=0.0)(Data(x=torch.tensor([[0.0, 0, 1]])))
        >>> data.x
        tensor([[0., 0., 1.]])
    """

    def __init__(self, sigma: float = 0.005, clip: float = 0.01, generator: torch.Generator | None = None) -> None:
        for name, value in (("sigma", sigma), ("clip", clip)):
            if not value >= 0:
                raise ValueError(f"Expected '{name}' of at least 0 (got {value})")
        self.sigma = sigma
        self.clip = clip
        self.generator = generator

    def forward(self, data: Data) -> Data:
        """Jitter the normals of a patch."""
        noise = torch.randn(data.x.shape, generator=self.generator, dtype=data.x.dtype) * self.sigma
        data.x = torch.nn.functional.normalize(data.x + noise.clamp(-self.clip, self.clip), dim=-1)
        return data

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sigma={self.sigma}, clip={self.clip})"
