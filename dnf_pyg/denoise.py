"""Noisy mesh in, denoised mesh out: cover it with patches, filter their normals, fuse them, move the vertices."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import torch
import trimesh
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.data.patch import Patch, PatchExtractor, patch_to_data
from dnf_pyg.data.seeds import cover
from dnf_pyg.errors import MeshError
from dnf_pyg.mesh.geometry import filled_face_normals
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.nn import DNFNet
from dnf_pyg.pretrained import DEFAULT_WEIGHTS, load_network

__all__ = ["DenoiseResult", "denoise", "filter_normals"]

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class DenoiseResult:
    """What :func:`denoise` returns.

    Attributes:
        mesh: The denoised mesh; vertex and face order are those of the input.
        normal: Filtered facet normals (F, 3), unit length, that the vertices were moved to fit.
        coverage: Number of patches that each face lay in (F,).
    """

    mesh: trimesh.Trimesh
    normal: Tensor
    coverage: Tensor


def denoise(
    mesh: trimesh.Trimesh,
    weights: str | Path | DNFNet = DEFAULT_WEIGHTS,
    *,
    patch_size: int = 800,
    min_coverage: int = 2,
    num_iterations: int = 20,
    batch_size: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
) -> DenoiseResult:
    """Denoise a triangle mesh.

    Args:
        mesh: The noisy mesh; it is not changed.
        weights: Name of packaged weights, a folder, a checkpoint (see :func:`load_network`), or a network.
        patch_size: Faces per patch.
        min_coverage: Patches that every face lies in, at least.
        num_iterations: Iterations of the vertex update.
        batch_size: Patches per call of the network.
        seed: Seed of the choice of patches; the same seed gives the same result.
        progress: Called with the number of faces covered so far and their total.

    Returns:
        The denoised mesh and what led to it.

    Raises:
        MeshError: If the mesh has no faces or coordinates that are not finite.
        WeightsError: If the weights cannot be loaded.
    """
    net = weights if isinstance(weights, DNFNet) else load_network(weights)
    if len(mesh.faces) == 0:
        raise MeshError(f"Expected a mesh with triangles (got {len(mesh.vertices)} vertices and no face)")
    pos = torch.tensor(mesh.vertices, dtype=torch.float64)
    face = torch.tensor(mesh.faces, dtype=torch.long).t().contiguous()
    normal, coverage = filter_normals(
        net,
        pos,
        face,
        patch_size=patch_size,
        min_coverage=min_coverage,
        batch_size=batch_size,
        seed=seed,
        progress=progress,
    )
    denoised = mesh.copy()
    denoised.vertices = update_vertices(pos, face, normal.double(), num_iterations=num_iterations).numpy()
    return DenoiseResult(denoised, normal, coverage)


@torch.no_grad()
def filter_normals(
    net: DNFNet,
    pos: Tensor,
    face: Tensor,
    *,
    patch_size: int = 800,
    min_coverage: int = 2,
    batch_size: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[Tensor, Tensor]:
    """Filter the facet normals of a whole mesh patch by patch.

    Overlapping patches are summed with a weight that falls from the seed face to the rim, where a patch lacks context.

    Args:
        net: The network, in evaluation mode.
        pos: Noisy vertex positions (V, 3).
        face: Faces (3, F).
        patch_size: Faces per patch.
        min_coverage: Patches that every face lies in, at least.
        batch_size: Patches per call of the network.
        seed: Seed of the choice of patches.
        progress: Called with the number of faces covered so far and their total.

    Returns:
        Filtered normals (F, 3), unit length, and the number of patches of each face (F,).
    """
    num_faces = face.size(1)
    noisy = filled_face_normals(pos, face).float()
    extractor = PatchExtractor(pos, face, patch_size=patch_size, k=max(net.k))
    patches = cover(extractor, min_coverage=min_coverage, generator=torch.Generator().manual_seed(seed))
    total = torch.zeros(num_faces, 3)
    coverage = torch.zeros(num_faces, dtype=torch.long)
    for group in _in_groups(patches, batch_size):
        batch = Batch.from_data_list([patch_to_data(patch, noisy) for patch in group])
        filtered = net(batch.normal, batch.edge_index, batch.batch)
        weight = torch.cat([_closeness(patch.distance) for patch in group])
        total.index_add_(0, batch.face_id, filtered.float() * weight[:, None])
        coverage.index_add_(0, batch.face_id, torch.ones_like(batch.face_id))
        if progress is not None:
            progress(int((coverage >= min_coverage).sum()), num_faces)
    return torch.nn.functional.normalize(total, dim=-1), coverage


def _closeness(distance: Tensor) -> Tensor:
    """Weight of each face of a patch (N,): 1 at the seed, nearly 0 at the rim."""
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
