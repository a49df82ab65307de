"""Random rotation of patches."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

__all__ = ["RandomRotation"]


class RandomRotation(BaseTransform):
    """Turn ``normal``, ``clean_normal`` and ``surface`` by one random rotation, uniform over all rotations.

    Source: Li et al. 2020, Sec. 3.2 (data augmentation).

    Args:
        generator: Source of randomness; the default of torch if not given.

    Example:
        >>> data = RandomRotation()(Data(normal=torch.tensor([[0.0, 0, 1]])))
        >>> bool(torch.isclose(data.normal.norm(), torch.tensor(1.0)))
        True
    """

    def __init__(self, generator: torch.Generator | None = None) -> None:
        self.generator = generator

    def forward(self, data: Data) -> Data:
        """Turn a patch."""
        w, x, y, z = torch.nn.functional.normalize(torch.randn(4, generator=self.generator), dim=0).tolist()
        rotation = data.normal.new_tensor(  # of the unit quaternion w + xi + yj + zk
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        data.normal = data.normal @ rotation.t()
        if "clean_normal" in data:
            data.clean_normal = data.clean_normal @ rotation.t()
        if "surface" in data:
            centroid, area = data.surface.split([3, 1], dim=1)
            data.surface = torch.cat([centroid @ rotation.t(), area], dim=1)
        return data

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"
