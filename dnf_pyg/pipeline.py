"""Denoises a mesh: filters its facet normals patch by patch, then moves the vertices to fit them."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import DenoiseWarning, OptionError
from dnf_pyg.io.inputs import as_input, as_mask
from dnf_pyg.mesh import boundary_vertices, validate_mesh
from dnf_pyg.mesh.geodesic import GROWTHS
from dnf_pyg.mesh.noise_level import estimate_noise_level
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_update import flipped_faces, update_vertices, without_flips
from dnf_pyg.mesh.weld import weld
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.nn.inference import evaluation_network, inference_device, sparser_edges, uses_bf16
from dnf_pyg.options import FAST, FilterOptions, UpdateOptions, check_range
from dnf_pyg.patches import FaceFeatures, PatchExtractor, cover
from dnf_pyg.patches.batching import batches
from dnf_pyg.patches.fusion import FusedNormals, PatchFusion
from dnf_pyg.progress import Progress, Stopwatch, part_of, progress_bar
from dnf_pyg.result import DenoiseResult
from dnf_pyg.weights.load import DEFAULT_WEIGHTS, load_network

_log = logging.getLogger(__name__)

__all__ = ["FAST", "DenoiseResult", "FilterOptions", "UpdateOptions", "denoise", "filter_normals"]


@contextmanager
def _cpu_by_default() -> Iterator[None]:
    """Create tensors on the CPU, whatever ``torch.set_default_device`` says."""
    with torch.device("cpu"):
        yield


@_cpu_by_default()
def denoise(
    mesh: Any,
    weights: str | Path | FilteringNetwork = DEFAULT_WEIGHTS,
    *,
    filtering: FilterOptions = FilterOptions(),
    update: UpdateOptions = UpdateOptions(),
    num_passes: int = 1,
    mask: Tensor | NDArray[np.bool_] | None = None,
    progress: bool | Progress | None = None,
) -> DenoiseResult:
    """Denoise a triangle mesh.

    Copies of a vertex at the same position (texture seams, triangle soups) move together. The result is equivariant to
    scaling and translation, and to rotation for networks that turn patches into a frame of their own.

    Args:
        mesh: The noisy mesh, which is not changed: a path, ``(vertices, faces)``, a PyG ``Data`` with ``pos`` and
            ``face``, or a mesh of trimesh, PyVista, Open3D or meshio; see :func:`~dnf_pyg.io.inputs.as_input`.
        weights: Name of packaged weights, a folder, a checkpoint (see :func:`load_network`), or a network.
        filtering: How the facet normals are filtered.
        update: How the vertices are moved.
        num_passes: Number of times the network filters the normals, each time those of its own result. Two passes suit
            strong noise on smooth surfaces.
        mask: Vertices that may move, (V,) bool; all if not given.
        progress: True shows a progress bar; a function is called with the number of faces done, over all passes, and
            their total. An exception that it raises, or Ctrl+C, ends the work there and passes through; the mesh is as
            it was.

    Returns:
        The denoised mesh and figures about it.

    Raises:
        MeshError: If the mesh is of an unknown kind, has no faces, or has coordinates that are not finite.
        MeshFileError: If it is a path that cannot be read.
        WeightsError: If the weights cannot be loaded.
        OptionError: If an option is out of its range.

    Warns:
        DenoiseWarning: For each entry of ``warnings`` of the result.
    """
    check_range("num_passes", num_passes, int, 1, float("inf"))
    watch = Stopwatch()
    source = as_input(mesh)
    net = weights if isinstance(weights, FilteringNetwork) else load_network(weights)
    validate_mesh(source.pos, source.face)
    movable = as_mask(mask, len(source.pos))
    start, face, vertex_id = weld(source.pos, source.face)
    topology = Topology(face, len(start))
    noise_level = estimate_noise_level(start, face, topology)
    fixed = torch.ones(len(start), dtype=torch.bool)
    fixed[vertex_id[movable]] = False  # a vertex stays where none of its copies may move
    if update.preserve_boundary:
        fixed |= boundary_vertices(face, len(start))
    watch.lap("prepare")
    pos, ended = start, list[tuple[int, str]]()
    bar = nullcontext(progress) if callable(progress) else progress_bar("filtering", "face", hidden=not progress)
    with bar as report:
        for turn in range(num_passes):
            options = replace(filtering, seed=(filtering.seed + turn) % 2**63)
            part = part_of(report, turn, num_passes)
            fused = filter_normals(net, pos, face, options, topology=topology, progress=part, watch=watch)
            normal = fused.normal.double()
            pos = update_vertices(
                start,
                face,
                normal,
                update.num_iterations,
                max_correlation=update.max_correlation,
                max_move=update.max_move / update.strength if update.strength > 0 else 0.0,
                fixed=fixed,
                topology=topology,
                ended=lambda *told: ended.append(told),
            )
            watch.lap("update")
    final = torch.where((pos != start).any(dim=1, keepdim=True), start.lerp(pos, update.strength), start)
    if 0 < update.strength < 1:  # halfway, a face may be flipped that is so at neither end
        final = without_flips(final, start, face, normal)
    before, after = (int(flipped_faces(where, face, normal).sum()) for where in (start, final))
    final = final[vertex_id]
    found = _warnings(noise_level, net.noise_range, after)
    for text in found:
        warnings.warn(text, DenoiseWarning, stacklevel=3)
    result = DenoiseResult(
        source.with_positions(final), final, source.face, *fused, noise_level, before, after, watch.seconds, found,
        *ended[-1], noisy_pos=source.pos,
    )  # fmt: skip
    _log.info("denoised %d faces in %s; %d iterations: %s", source.face.size(1), watch.seconds, *ended[-1])
    return result


@_cpu_by_default()
@torch.no_grad()
def filter_normals(
    net: FilteringNetwork,
    pos: Tensor,
    face: Tensor,
    filtering: FilterOptions = FilterOptions(),
    *,
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
        topology: Connectivity of the mesh, which then is not validated; computed if not given.
        progress: Called with the number of faces covered so far and their total.
        watch: Takes the time of each stage.

    Returns:
        Filtered normals, (F, 3), with the coverage and confidence of each face.

    Raises:
        MeshError: See :func:`~dnf_pyg.mesh.validate_mesh`.
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
    pos = (pos - pos.mean(dim=0)) / topology.mean_edge_length(pos).clamp(min=torch.finfo(pos.dtype).tiny)
    features = FaceFeatures.from_mesh(pos, face)
    extractor = PatchExtractor(pos, face, GROWTHS[filtering.growth](), filtering.patch_size, max(net.k), topology)
    generator = torch.Generator().manual_seed(filtering.seed)
    patches = cover(extractor, min_coverage=filtering.coverage, generator=generator)
    fusion = PatchFusion(extractor.num_faces)
    for group, batch in batches(patches, features, filtering.batch_size * filtering.patch_size):
        watch.lap("patches")
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=uses_bf16(filtering.precision, device)):
            sent = batch.to(device)
            filtered = net(**net.gather(sent, sparser_edges(sent, net.k, filtering.k)))
        watch.lap("network")
        fusion.add(group, filtered.float().cpu())
        progress(int((fusion.coverage >= filtering.coverage).sum()), extractor.num_faces)
        watch.lap("fuse")
    watch.lap("patches")
    return fusion.result()


def _warnings(noise_level: float, noise_range: tuple[float, float] | None, num_flipped: int) -> list[str]:
    lowest, highest = noise_range or (0.0, float("inf"))
    found = {
        f"The noise level of about {noise_level:.3f} mean edge lengths is below {lowest}, the lowest that the weights "
        "were trained on: fine detail may be smoothed away. A lower strength keeps it.": noise_level < lowest,
        f"The noise level of about {noise_level:.2f} mean edge lengths is above {highest}, the highest that the "
        "weights were trained on. Use two passes, or train on such noise.": noise_level > highest,
        f"Faces that remain flipped because the input is folded there: {num_flipped}.": num_flipped > 0,
    }
    return [text for text, applies in found.items() if applies]
