"""Filtered facet normals of a whole mesh: cover it with patches, filter each, fuse them."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.errors import WeightsError
from dnf_pyg.mesh.geodesic import Growth
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.nn.thinning import evenly_spaced_ranks, select_ranks
from dnf_pyg.patches.patch import FaceFeatures, Patch, PatchExtractor, patch_to_data
from dnf_pyg.patches.seeds import cover

__all__ = ["FilteredNormals", "Progress", "filter_normals"]

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class FilteredNormals:
    """What :func:`filter_normals` returns.

    Attributes:
        normal: Filtered facet normals, (F, 3), unit length.
        coverage: Number of patches that each face lay in, (F,).
        confidence: How well these patches agree, (F,): 1 where they say the same, towards 0 where they contradict.
        seconds: Time spent by stage.
    """

    normal: Tensor
    coverage: Tensor
    confidence: Tensor
    seconds: dict[str, float]


@torch.no_grad()
def filter_normals(
    net: FilteringNetwork,
    pos: Tensor,
    face: Tensor,
    *,
    growth: Growth | None = None,
    patch_size: int = 800,
    min_coverage: int = 2,
    neighbors: Sequence[int] | None = None,
    batch_size: int = 4,
    seed: int = 0,
    device: str | torch.device = "cpu",
    precision: torch.dtype = torch.float32,
    progress: Progress | None = None,
) -> FilteredNormals:
    """Filter the facet normals of a whole mesh patch by patch.

    Overlapping patches are summed with a weight that falls from the seed face to the rim, where a patch lacks context.

    Args:
        net: The network, in evaluation mode.
        pos: Noisy vertex positions, (V, 3).
        face: Faces, (3, F).
        growth: How a patch grows around its seed; by Dijkstra's algorithm if not given.
        patch_size: Faces per patch.
        min_coverage: Patches that every face lies in, at least.
        neighbors: Neighbours per face on each level of the network, spread over the ``net.k`` nearest; all of these if
            not given.
        batch_size: Patches per call of the network.
        seed: Seed of the choice of patches.
        device: Where the network runs.
        precision: Type of its matrix products.
        progress: Called with the number of faces covered so far and their total.

    Returns:
        Filtered normals, and how they came about.

    Raises:
        WeightsError: If ``neighbors`` are not as many as the network has levels.
    """
    if neighbors is not None and len(neighbors) != len(net.k):
        raise WeightsError(
            f"Expected a network of {len(neighbors)} levels for 'neighbors' {tuple(neighbors)} (got one of "
            f"{len(net.k)}): give a number for each of its levels, or leave them out"
        )
    clock = time.perf_counter
    started = clock()
    pos = (pos - pos.mean(dim=0)) / mean_edge_length(pos, face).clamp(min=torch.finfo(pos.dtype).tiny)
    num_faces = face.size(1)
    features = FaceFeatures.from_mesh(pos, face)
    extractor = PatchExtractor(pos, face, growth, patch_size, k=max(net.k))
    patches = cover(extractor, min_coverage=min_coverage, generator=torch.Generator().manual_seed(seed))
    total, weights = torch.zeros(num_faces, 3), torch.zeros(num_faces)
    coverage = torch.zeros(num_faces, dtype=torch.long)
    seconds = {"patches": 0.0, "network": 0.0, "fuse": 0.0}
    net, device = net.to(device), torch.device(device)
    for group in _in_groups(patches, batch_size):
        batch = Batch.from_data_list([patch_to_data(patch, features) for patch in group])
        seconds["patches"] += clock() - started
        started = clock()
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=precision == torch.bfloat16):
            sent = batch.to(device)
            filtered = net(**net.gather(sent, _edges(sent, net.k, neighbors))).float().cpu()
        seconds["network"] += clock() - started
        started = clock()
        weight = torch.cat([_closeness(patch.distance) for patch in group])
        face_id = batch.face_id.cpu()
        total.index_add_(0, face_id, filtered * weight[:, None])
        weights.index_add_(0, face_id, weight)
        coverage.index_add_(0, face_id, torch.ones_like(face_id))
        if progress is not None:
            progress(int((coverage >= min_coverage).sum()), num_faces)
        seconds["fuse"] += clock() - started
        started = clock()
    seconds["patches"] += clock() - started
    normal = torch.nn.functional.normalize(total, dim=-1)
    return FilteredNormals(normal, coverage, total.norm(dim=-1) / weights, seconds)


def _edges(batch: Batch, k: Sequence[int], neighbors: Sequence[int] | None) -> list[Tensor] | None:
    """Edges of each level where it is to have fewer neighbours than the network knows."""
    if neighbors is None:
        return None
    ranks = (evenly_spaced_ranks(most, min(most, keep)) for most, keep in zip(k, neighbors, strict=True))
    return [select_ranks(batch.edge_index, batch.edge_attr, level) for level in ranks]


def _closeness(distance: Tensor) -> Tensor:
    """Weight of each face of a patch, (N,): 1 at the seed, nearly 0 at the rim."""
    return 1.001 - distance / distance.max().clamp(min=torch.finfo(distance.dtype).tiny)


def _in_groups(patches: Iterator[Patch], size: int) -> Iterator[list[Patch]]:
    group: list[Patch] = []
    for patch in patches:
        group.append(patch)
        if len(group) == size:
            yield group
            group = []
    if group:
        yield group
