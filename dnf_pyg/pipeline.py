"""Denoises a mesh: filters its facet normals patch by patch, then moves the vertices to fit them."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import DenoiseWarning, OptionError
from dnf_pyg.findings import findings
from dnf_pyg.io.inputs import as_input, as_mask, save_mesh
from dnf_pyg.mesh import boundary_vertices, validate_mesh
from dnf_pyg.mesh.geodesic import GROWTHS
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.local_noise import LocalNoise
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_update import flipped_faces, update_vertices, without_flips
from dnf_pyg.mesh.weld import weld
from dnf_pyg.mesh.winding import consistent_faces
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.nn.inference import evaluation_network, sparser_edges
from dnf_pyg.options import FAST, FilterOptions, UpdateOptions, check_range
from dnf_pyg.patches import FaceFeatures, PatchExtractor, cover
from dnf_pyg.patches.batching import batches
from dnf_pyg.patches.fusion import FusedNormals, PatchFusion
from dnf_pyg.progress import Progress, Stopwatch, part_of, progress_bar
from dnf_pyg.weights.load import DEFAULT_WEIGHTS, load_network

__all__ = ["FAST", "DenoiseResult", "FilterOptions", "UpdateOptions", "denoise", "filter_normals"]


@dataclass(frozen=True)
class DenoiseResult:
    """Result of :func:`denoise`.

    Attributes:
        mesh: The denoised mesh, of the kind that was given (:class:`~dnf_pyg.io.files.MeshFile` for a path); all but
            its vertex positions is as in the input.
        pos: Its vertex positions, (V, 3) float64.
        face: Its triangles, (3, F).
        normal: Filtered facet normals, (F, 3), unit length, which the vertices were moved to fit where they moved.
        coverage: Number of patches that held each face, (F,).
        confidence: Agreement of these patches, (F,), up to 1.
        noise_level: Estimated noise level of the input, in mean edge lengths.
        flipped_before: Number of faces of the input more than 90 degrees from their filtered normal.
        flipped_after: Number of such faces of the result.
        seconds: Time by stage.
        warnings: Properties of the input or result that make it less reliable, a sentence each.
        left_alone: Share of the vertices that stay in place since the noise does not explain what would change there.
    """

    mesh: Any
    pos: Tensor
    face: Tensor
    normal: Tensor
    coverage: Tensor
    confidence: Tensor
    noise_level: float
    flipped_before: int
    flipped_after: int
    seconds: dict[str, float]
    warnings: list[str]
    left_alone: float

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Vertex positions of the denoised mesh, (V, 3)."""
        return self.pos.numpy()

    def save(self, path: str | Path) -> None:
        """Write the denoised mesh; the ending of the path decides the format.

        Raises:
            MeshFileError: If the format is unknown.
            OutputError: If the file cannot be written.
        """
        save_mesh(self.mesh, self.pos, self.face, path)


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
            their total.

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
    start, welded, vertex_id = weld(source.pos, source.face)
    sides = consistent_faces(welded)
    face = sides.face
    topology = Topology(face, len(start))
    noise = LocalNoise(start, face, topology)
    noise_level = noise.estimate.level
    fixed = torch.ones(len(start), dtype=torch.bool)
    fixed[vertex_id[movable]] = False  # a vertex stays where none of its copies may move
    if update.preserve_boundary:
        fixed |= boundary_vertices(face, len(start))
    watch.lap("prepare")
    pos = start
    bar = nullcontext(progress) if callable(progress) else progress_bar("filtering", "face", hidden=not progress)
    with bar as report:
        for turn in range(num_passes):
            options = replace(filtering, seed=(filtering.seed + turn) % 2**63)
            part = part_of(report, turn, num_passes)
            fused = filter_normals(net, pos, face, options, topology=topology, progress=part, watch=watch)
            stays, furthest = noise.restraint(fused.normal, update.max_excess)
            own = stays[face].all(dim=0)[:, None]  # faces that stay as they are, whatever the network says
            normal = torch.where(own, face_normals(start, face), fused.normal.double())
            pos = update_vertices(
                start,
                face,
                normal,
                update.num_iterations,
                max_correlation=update.max_correlation,
                max_move=furthest.clamp(max=update.max_move / update.strength if update.strength > 0 else 0.0),
                fixed=fixed | stays,
                topology=topology,
            )
            watch.lap("update")
    final = torch.where((pos != start).any(dim=1, keepdim=True), start.lerp(pos, update.strength), start)
    if 0 < update.strength < 1:  # halfway, a face may be flipped that is so at neither end
        final = without_flips(final, start, face, normal)
    before, after = (int(flipped_faces(where, face, normal).sum()) for where in (start, final))
    final = torch.where((final != start).any(dim=1)[vertex_id, None], final[vertex_id], source.pos)
    left_alone = float((stays & ~fixed)[face].double().mean())
    found = findings(noise_level, net.noise_range, left_alone, sides.num_turned, sides.num_doubled, after)
    for text in found:
        warnings.warn(text, DenoiseWarning, stacklevel=3)
    turned, coverage, confidence = (value[sides.face_id] for value in fused)
    mesh, filtered, seconds = source.with_positions(final), turned * sides.sign[:, None], watch.seconds
    return DenoiseResult(
        mesh, final, source.face, filtered, coverage, confidence, noise_level, before, after, seconds, found, left_alone
    )


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
    device = torch.device(filtering.device)
    net = evaluation_network(net, device)
    pos = (pos - pos.mean(dim=0)) / topology.mean_edge_length(pos).clamp(min=torch.finfo(pos.dtype).tiny)
    features = FaceFeatures.from_mesh(pos, face)
    extractor = PatchExtractor(pos, face, GROWTHS[filtering.growth](), filtering.patch_size, max(net.k), topology)
    generator = torch.Generator().manual_seed(filtering.seed)
    patches = cover(extractor, min_coverage=filtering.coverage, generator=generator)
    fusion = PatchFusion(extractor.num_faces)
    for group, batch in batches(patches, features, filtering.batch_size * filtering.patch_size):
        watch.lap("patches")
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=filtering.precision == "bf16"):
            sent = batch.to(device)
            filtered = net(**net.gather(sent, sparser_edges(sent, net.k, filtering.k)))
        watch.lap("network")
        fusion.add(group, filtered.float().cpu())
        progress(int((fusion.coverage >= filtering.coverage).sum()), extractor.num_faces)
        watch.lap("fuse")
    watch.lap("patches")
    return fusion.result()
