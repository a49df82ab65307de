"""Fuses what a network gives for overlapping patches into one normal per face."""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional as F

from dnf_pyg.patches.patch import Patch

__all__ = ["FusedNormals", "PatchFusion", "closeness"]


class FusedNormals(NamedTuple):
    """One normal per face, and how much can be relied on it.

    Attributes:
        normal: Facet normals, (F, 3), unit length; zero for a face that no patch holds.
        coverage: Number of patches that hold each face, (F,) long.
        confidence: Length of the weighted mean of the normals of these patches, (F,): 1 where they agree, towards 0
            where they contradict each other.
    """

    normal: Tensor
    coverage: Tensor
    confidence: Tensor


class PatchFusion:
    """Weighted mean of the normals that overlapping patches give for a face.

    The weight of a face falls from the seed of a patch to its rim (:func:`closeness`), where context is missing.

    Args:
        num_faces: Faces of the mesh F.

    Example:
        >>> from dnf_pyg.patches import Patch
        >>> fusion = PatchFusion(num_faces=2)
        >>> fusion.add([Patch(torch.tensor([0]), torch.tensor([[0]]), torch.zeros(1))], torch.tensor([[0.0, 0.0, 1.0]]))
        >>> fusion.result().coverage
        tensor([1, 0])
    """

    def __init__(self, num_faces: int) -> None:
        self._total = torch.zeros(num_faces, 3, dtype=torch.float32)
        self._weight = torch.zeros(num_faces, dtype=torch.float32)
        self.coverage = torch.zeros(num_faces, dtype=torch.long)

    def add(self, patches: Sequence[Patch], normal: Tensor) -> None:
        """Add the normals of some patches.

        Args:
            patches: The patches.
            normal: Normals of their faces, (N, 3) float32, one patch after the other.
        """
        face_id = torch.cat([patch.face_id for patch in patches])
        size = torch.tensor([patch.face_id.size(0) for patch in patches])
        batch = torch.arange(len(patches)).repeat_interleave(size)
        weight = closeness(torch.cat([patch.distance for patch in patches]), batch)
        self._total.index_add_(0, face_id, normal * weight[:, None])
        self._weight.index_add_(0, face_id, weight)
        self.coverage.index_add_(0, face_id, torch.ones_like(face_id))

    def result(self) -> FusedNormals:
        """Fuse what was added."""
        confidence = self._total.norm(dim=-1) / self._weight.clamp(min=torch.finfo(torch.float32).tiny)
        return FusedNormals(F.normalize(self._total, dim=-1), self.coverage, confidence)


def closeness(distance: Tensor, batch: Tensor | None = None) -> Tensor:
    """Compute the weight of each face of a patch: 1 at the seed, nearly 0 at the rim.

    Args:
        distance: Geodesic distance of each face from the seed of its patch, (N,).
        batch: Patch of each face, sorted, (N,); one patch if ``None``.

    Returns:
        Weights, (N,).

    Example:
        >>> [round(weight, 3) for weight in closeness(torch.tensor([0.0, 1.0, 2.0])).tolist()]
        [1.001, 0.501, 0.001]
    """
    if batch is None:
        rim = distance.max()
    else:
        rim = distance.new_zeros(int(batch[-1]) + 1).scatter_reduce_(0, batch, distance, "amax")[batch]
    return 1.001 - distance / rim.clamp(min=torch.finfo(distance.dtype).tiny)
