"""Filters the facet normals of a mesh by one network, patch by patch."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import torch
from torch import Tensor

from dnf_pyg.errors import OptionError
from dnf_pyg.mesh import validate_mesh
from dnf_pyg.mesh.geodesic import GROWTHS
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.nn.frame import in_frame
from dnf_pyg.nn.inference import evaluation_network, inference_device, sparser_edges, uses_bf16
from dnf_pyg.options import FilterOptions
from dnf_pyg.patches import FaceFeatures, PatchExtractor, cover
from dnf_pyg.patches.batching import batches
from dnf_pyg.patches.fusion import FusedNormals, PatchFusion
from dnf_pyg.patches.rotation import random_rotations, rotate_patches
from dnf_pyg.progress import Progress, Stopwatch

__all__ = ["filter_normals", "on_cpu"]


@contextmanager
def on_cpu() -> Iterator[None]:
    """Create tensors on the CPU, whatever ``torch.set_default_device`` says."""
    there = torch.get_default_device().type == "cpu"  # to say it once more would slow down every call of torch
    with nullcontext() if there else torch.device("cpu"):
        yield


@on_cpu()
@torch.no_grad()
def filter_normals(
    net: FilteringNetwork,
    pos: Tensor,
    face: Tensor,
    filtering: FilterOptions = FilterOptions(),
    *,
    earlier: Tensor | None = None,
    topology: Topology | None = None,
    progress: Progress = lambda done, total: None,
    watch: Stopwatch | None = None,
) -> FusedNormals:
    """Filter the facet normals of a mesh patch by patch, and fuse them where patches overlap.

    Args:
        net: The network. It runs in evaluation mode, and is not changed.
        pos: Noisy vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        filtering: How the facet normals are filtered.
        earlier: Further facet normals, (F, M, 3), for a later network of a :class:`~dnf_pyg.nn.Cascade`.
        topology: Connectivity of the mesh, which then is not validated; computed if not given.
        progress: Called with the number of faces covered so far and their total.
        watch: Takes the time of each stage.

    Returns:
        Filtered normals, (F, 3), with the coverage and confidence of each face.

    Raises:
        MeshError: See :func:`~dnf_pyg.mesh.validate_mesh`.
        ValueError: If the network needs ``earlier``.
        OptionError: If ``filtering.k`` does not have one entry for each level of the network.
    """
    if filtering.k is not None and len(filtering.k) != len(net.k):
        raise OptionError(
            f"Expected 'k' with {len(net.k)} numbers, one for each level of the network (got {filtering.k}). Change it."
        )
    if topology is None:
        validate_mesh(pos, face)
        topology = Topology(face, len(pos))
    watch = watch or Stopwatch()
    device = inference_device(filtering.device)
    net = evaluation_network(net, device)
    pos = (pos - pos.mean(dim=0)) / (float(topology.mean_edge_length(pos)) or 1.0)
    features = FaceFeatures.from_mesh(pos, face, earlier)
    extractor = PatchExtractor(pos, face, GROWTHS[filtering.growth](), filtering.patch_size, max(net.k), topology)
    generator, turns = (torch.Generator().manual_seed(filtering.seed) for _ in range(2))
    patches = cover(extractor, min_coverage=filtering.coverage, generator=generator)
    fusion = PatchFusion(extractor.num_faces)
    for group, batch in batches(patches, features, filtering.batch_size * filtering.patch_size):
        if net.random_rotation:
            rotation = random_rotations(len(group), turns)
            batch = rotate_patches(batch, rotation)
        watch.lap("patches")
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=uses_bf16(filtering.precision, device)):
            sent = batch.to(device)
            filtered = net(**net.gather(sent, sparser_edges(sent, net.k, filtering.k)))
        watch.lap("network")
        filtered = filtered.float().cpu()
        if net.random_rotation:
            filtered = in_frame(filtered, rotation[batch.batch])
        fusion.add(group, filtered)
        progress(int((fusion.coverage >= filtering.coverage).sum()), extractor.num_faces)
        watch.lap("fuse")
    watch.lap("patches")
    return fusion.result()
