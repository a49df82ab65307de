"""Seed faces of patches: sampled for training, chosen to cover the mesh for inference."""

from collections.abc import Iterator
from typing import Protocol

import torch
from torch import Generator, Tensor

from dnf_pyg.data.patch import Patch, PatchExtractor
from dnf_pyg.mesh import one_ring

__all__ = ["AnisotropicSeeds", "SeedSampler", "UniformSeeds", "cover"]


class SeedSampler(Protocol):
    """How the seeds of training patches are drawn; chosen by class."""

    def __call__(self, normal: Tensor, face: Tensor, num_seeds: int, generator: Generator | None = None) -> Tensor:
        """Draw seed faces without replacement; the faces repeat only after all were drawn.

        Args:
            normal: Facet normals, shape (F, 3), unit length.
            face: Vertices of each face, shape (3, F).
            num_seeds: Number of seeds P.
            generator: Source of randomness.

        Returns:
            Face ids, shape (P,) long.
        """
        ...


class AnisotropicSeeds:
    """Draw seeds with a chance that grows with the normal variation in the one-ring of the face.

    The variation is the mean of 1 - cos of the angle to the faces around. Source: Li et al. 2020, Sec. 3.2.

    Args:
        floor: Variation given to every face in addition, as a share of the mean variation, so that flat regions
            are seen too.

    Raises:
        ValueError: If ``floor`` is not positive.

    Example:
        >>> normal = torch.tensor([[0.0, 0, 1], [0, 0, 1]])
        >>> AnisotropicSeeds()(normal, torch.tensor([[0, 1], [1, 3], [2, 2]]), num_seeds=2).sort().values
        tensor([0, 1])
    """

    def __init__(self, floor: float = 0.1) -> None:
        if not floor > 0:
            raise ValueError(f"Expected 'floor' above 0 (got {floor})")
        self.floor = floor

    def __call__(self, normal: Tensor, face: Tensor, num_seeds: int, generator: Generator | None = None) -> Tensor:
        """Draw seed faces, see :class:`SeedSampler`."""
        neighbor, centre = one_ring(face, int(face.max()) + 1)
        variation = normal.new_zeros(face.size(1), dtype=torch.double)
        variation.index_add_(0, centre, 1.0 - (normal[neighbor].double() * normal[centre].double()).sum(dim=-1))
        variation = variation.clamp(min=0) / torch.bincount(centre, minlength=face.size(1)).clamp(min=1)
        mean = variation.mean()
        return _draw(variation + self.floor * mean if mean > 0 else torch.ones_like(variation), num_seeds, generator)

    def __repr__(self) -> str:
        return f"{type(self).__name__}(floor={self.floor})"


class UniformSeeds:
    """Draw seeds with the same chance for every face.

    Example:
        >>> normal = torch.tensor([[0.0, 0, 1], [0, 0, 1]])
        >>> UniformSeeds()(normal, torch.tensor([[0, 1], [1, 3], [2, 2]]), num_seeds=2).sort().values
        tensor([0, 1])
    """

    def __call__(self, normal: Tensor, face: Tensor, num_seeds: int, generator: Generator | None = None) -> Tensor:
        """Draw seed faces, see :class:`SeedSampler`."""
        return _draw(torch.ones(face.size(1), dtype=torch.double), num_seeds, generator)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


def _draw(weight: Tensor, num_seeds: int, generator: Generator | None) -> Tensor:
    """Draw rows without replacement, with chances in proportion to their weights (Efraimidis and Spirakis 2006)."""
    drawn: list[Tensor] = []
    while num_seeds > 0:
        chance = torch.rand(weight.shape, generator=generator, dtype=torch.double).clamp(min=1e-300)
        rounds = (-chance.log() / weight).topk(min(num_seeds, len(weight)), largest=False).indices
        drawn.append(rounds)
        num_seeds -= len(rounds)
    return torch.cat(drawn) if drawn else torch.empty(0, dtype=torch.long)


def cover(extractor: PatchExtractor, min_coverage: int = 2, generator: Generator | None = None) -> Iterator[Patch]:
    """Cut patches until every face lies in at least ``min_coverage`` of them, one after the other.

    Every seed is a least covered face.

    Args:
        extractor: Patches of the mesh.
        min_coverage: Patches that every face must lie in.
        generator: Source of randomness; the same state gives the same patches.

    Raises:
        ValueError: If ``min_coverage`` is not positive.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> extractor = PatchExtractor(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        >>> [len(patch.face_id) for patch in cover(extractor, min_coverage=3)]
        [2, 2, 2]
    """
    if min_coverage < 1:
        raise ValueError(f"Expected 'min_coverage' of at least 1 (got {min_coverage})")
    count = torch.zeros(extractor.num_faces, dtype=torch.long)
    order = torch.randperm(extractor.num_faces, generator=generator)
    for level in range(min_coverage):
        for seed in order.tolist():
            if count[seed] <= level:
                patch = extractor.extract(seed)
                count[patch.face_id] += 1
                yield patch
