"""Random rotation of patches."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

__all__ = ["RandomRotation"]


class RandomRotation(BaseTransform):
    """Rotate ``x``, ``y`` and ``pos`` by one random rotation, uniform over all rotations.

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
        w, x, y, z = torch.nn.functional.normalize(torch.randn(4, generator=self.generator), dim=0).tolist()
        rotation = data.x.new_tensor(  # of the unit quaternion w + xi + yj + zk
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        for name in ("x", "y", "pos"):
            if data.get(name) is not None:
                data[name] = data[name] @ rotation.t()
        return data

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"
