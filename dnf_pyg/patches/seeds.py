"""Seed faces of patches: sampled for training, chosen to cover the mesh for inference."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from torch import Generator, Tensor

from dnf_pyg.mesh import one_ring
from dnf_pyg.patches.coverage import plan_seeds
from dnf_pyg.patches.patch import Patch, PatchExtractor

__all__ = ["AnisotropicSeeds", "cover"]


class AnisotropicSeeds:
    """Draw seed faces with a probability that grows with the variation of the normals in their one-ring.

    The variation is the mean of one minus the cosine of the angle to each face of the one-ring.
    Source: Li et al. 2020, Sec. 3.2.

    Args:
        floor: Constant added to the variation of every face, as a share of the mean variation, so that flat regions
            are sampled too.

    Raises:
        ValueError: If ``floor`` is not positive.

    Example:
        >>> normal = torch.tensor([[0.0, 0, 1], [0, 0, 1]])
        >>> AnisotropicSeeds()(normal, torch.tensor([[0, 1], [1, 3], [2, 2]]), num_seeds=2).sort().values
        tensor([0, 1])
    """

    def __init__(self, floor: float = 0.1) -> None:
        if not floor > 0:
            raise ValueError(f"Expected 'floor' above 0 (got {floor}). Without it flat regions are never sampled.")
        self.floor = floor

    def weight(self, normal: Tensor, face: Tensor) -> Tensor:
        """Compute the weight of each face, the variation plus the floor.

        Args:
            normal: Facet normals, shape (F, 3), unit length.
            face: Vertices of each face, shape (3, F).

        Returns:
            Positive weights, shape (F,) float64.
        """
        neighbor, centre = one_ring(face, int(face.max()) + 1)
        variation = normal.new_zeros(face.size(1), dtype=torch.double)
        variation.index_add_(0, centre, 1.0 - (normal[neighbor].double() * normal[centre].double()).sum(dim=-1))
        variation = variation.clamp(min=0) / torch.bincount(centre, minlength=face.size(1)).clamp(min=1)
        mean = variation.mean()
        return variation + self.floor * mean if mean > 0 else torch.ones_like(variation)

    def __call__(self, normal: Tensor, face: Tensor, num_seeds: int, generator: Generator | None = None) -> Tensor:
        """Draw seed faces without replacement; faces repeat only after all have been drawn.

        Source: Efraimidis and Spirakis 2006.

        Args:
            normal: Facet normals, shape (F, 3), unit length.
            face: Vertices of each face, shape (3, F).
            num_seeds: Number of seeds P.
            generator: Source of randomness.

        Returns:
            Face ids, shape (P,) long.
        """
        weight = self.weight(normal, face)
        drawn = [torch.empty(0, dtype=torch.long, device="cpu")]
        for first in range(0, num_seeds, len(weight)):
            chance = torch.rand(weight.shape, generator=generator, dtype=torch.double, device="cpu").clamp(min=1e-300)
            drawn.append((-chance.log() / weight).topk(min(num_seeds - first, len(weight)), largest=False).indices)
        return torch.cat(drawn)

    def __repr__(self) -> str:
        return f"{type(self).__name__}(floor={self.floor})"


def cover(extractor: PatchExtractor, min_coverage: int = 2, generator: Generator | None = None) -> Iterator[Patch]:
    """Cut patches one after the other until every face lies in at least ``min_coverage`` of them.

    The seeds are planned ahead (:mod:`dnf_pyg.patches.coverage`). Where the patches differ from the plan, as with
    :class:`~dnf_pyg.mesh.HeatGrowth`, more are cut, each around the first of the faces that are covered least.

    Differs: the authors' code of Li et al. 2020 cuts a patch around every face and keeps the normal of that face alone.

    Args:
        extractor: Cuts the patches of the mesh.
        min_coverage: Smallest number of patches that each face lies in.
        generator: Source of randomness; the same state gives the same patches.

    Yields:
        The patches.

    Raises:
        ValueError: If ``min_coverage`` is not positive.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> extractor = PatchExtractor(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        >>> [len(patch.face_id) for patch in cover(extractor, min_coverage=3)]
        [2, 2, 2]
    """
    if min_coverage < 1:
        raise ValueError(f"Expected 'min_coverage' of at least 1 (got {min_coverage}). Raise it.")
    count = np.zeros(extractor.num_faces, np.int32)
    seeds = plan_seeds(extractor.graph, extractor.patch_size, min_coverage, generator).tolist()
    num_threads = torch.get_num_threads()
    with ThreadPoolExecutor(num_threads) as pool:
        for first in range(0, len(seeds), 4 * num_threads):  # the threads pause while the caller works on these
            for patch in pool.map(extractor.extract, seeds[first : first + 4 * num_threads]):
                count[patch.face_id.numpy()] += 1
                yield patch
    while int(count.min()) < min_coverage:
        patch = extractor.extract(int(count.argmin()))
        count[patch.face_id.numpy()] += 1
        yield patch
