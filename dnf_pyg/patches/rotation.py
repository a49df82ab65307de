"""Rotations of patches."""

import copy

import torch
from torch import Generator, Tensor
from torch_geometric.data import Data

__all__ = ["random_rotations", "rotate_patches"]


def random_rotations(num_rotations: int, generator: Generator | None = None) -> Tensor:
    """Draw rotation matrices, (R, 3, 3), uniform over all rotations.

    Args:
        num_rotations: Number of matrices R.
        generator: Source of randomness; the default of torch if not given.

    Example:
        >>> rotation = random_rotations(2)
        >>> torch.allclose(rotation @ rotation.mT, torch.eye(3), atol=1e-6), rotation.det().round().tolist()
        (True, [1.0, 1.0])
    """
    w, x, y, z = torch.nn.functional.normalize(torch.randn(num_rotations, 4, generator=generator), dim=1).unbind(dim=1)
    rows = (  # of the unit quaternion w + xi + yj + zk
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return torch.stack([torch.stack(row, dim=1) for row in rows], dim=1)


def rotate_patches(data: Data, rotation: Tensor) -> Data:
    """Rotate the vectors ``x``, ``y``, ``pos`` and ``earlier`` of each patch.

    Args:
        data: Patch or batch of patches.
        rotation: Rotation of each patch, (P, 3, 3), or one for all, (1, 3, 3).

    Returns:
        A copy that shares all else.

    Example:
        >>> quarter = torch.tensor([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
        >>> rotate_patches(Data(x=torch.tensor([[1.0, 0.0, 0.0]])), quarter).x
        tensor([[0., 1., 0.]])
    """
    rotated = copy.copy(data)
    of_face = rotation if len(rotation) == 1 else rotation[data.batch]
    for name in ("x", "y", "pos", "earlier"):
        if data.get(name) is not None:
            rotated[name] = torch.einsum(
                "fij,f...j->f...i", of_face.to(data[name]).expand(len(data[name]), 3, 3), data[name]
            )
    return rotated
