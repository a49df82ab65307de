"""Denoises a mesh: filters its facet normals patch by patch, then moves the vertices to fit them."""

import logging
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import DenoiseWarning
from dnf_pyg.filtering import on_cpu
from dnf_pyg.findings import findings
from dnf_pyg.io.inputs import as_input, as_mask
from dnf_pyg.mesh import boundary_vertices, validate_mesh
from dnf_pyg.mesh.flips import flipped_faces, without_flips
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.local_noise import LocalNoise
from dnf_pyg.mesh.noise_level import estimate_noise
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.weld import weld
from dnf_pyg.mesh.winding import consistent_faces
from dnf_pyg.nn import Cascade, FilteringNetwork
from dnf_pyg.options import DEFAULT_WEIGHTS, FAST, FilterOptions, UpdateOptions, check_range
from dnf_pyg.progress import Progress, Stopwatch, progress_bar
from dnf_pyg.result import DenoiseResult
from dnf_pyg.steps import Steps
from dnf_pyg.weights.load import load_cascade

_log = logging.getLogger(__name__)

__all__ = ["FAST", "DenoiseResult", "FilterOptions", "UpdateOptions", "denoise"]


@on_cpu()
def denoise(
    mesh: Any,
    weights: str | Path | FilteringNetwork | Cascade = DEFAULT_WEIGHTS,
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
        weights: Name of packaged weights, a folder, a checkpoint
            (see :func:`~dnf_pyg.weights.load.load_cascade`), or networks.
        filtering: How the facet normals are filtered.
        update: How the vertices are moved.
        num_passes: Number of times all this is done, each time on the result of the pass before. Two passes suit
            noise of more than 0.5 mean edge lengths.
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
    cascade = _loaded(weights)
    validate_mesh(source.pos, source.face)
    movable = as_mask(mask, len(source.pos))
    start, welded, vertex_id = weld(source.pos, source.face)
    sides = consistent_faces(welded)
    face = sides.face
    topology = Topology(face, len(start))
    local = None if update.max_excess == float("inf") else LocalNoise(start, face, topology)
    noise = estimate_noise(start, face, topology) if local is None else local.estimate
    fixed = torch.ones(len(start), dtype=torch.bool)
    fixed[vertex_id[movable]] = False  # a vertex stays where none of its copies may move
    if update.preserve_boundary:
        fixed |= boundary_vertices(face, len(start))
    watch.lap("prepare")
    ended: list[tuple[int, str]] = []
    bar = nullcontext(progress) if callable(progress) else progress_bar("filtering", "face", hidden=not progress)
    with bar as report:
        steps = Steps(
            cascade, filtering, update, noise, num_passes, report, watch, ended=lambda *told: ended.append(told),
        )  # fmt: skip
        pos, fused = steps(start, face, fixed, topology, local)
    stays = torch.zeros(len(start), dtype=torch.bool)
    if local is not None:
        stays = local.unexplained(fused.normal, update.max_excess)
    own = stays[face].all(dim=0)[:, None]  # faces that stay as they are, whatever the network says
    normal = torch.where(own, face_normals(start, face), fused.normal.double())
    moves = (pos != start).any(dim=1) & ~stays
    final = torch.where(moves[:, None], start.lerp(pos, update.strength), start)
    if stays.any() or 0 < update.strength < 1:  # a face may be flipped that is so at neither end
        final = without_flips(final, start, face, normal)
    before, after = (int(flipped_faces(where, face, normal).sum()) for where in (start, final))
    final = torch.where((final != start).any(dim=1)[vertex_id, None], final[vertex_id], source.pos)
    left_alone = float((stays & ~fixed)[face].double().mean())
    found = findings(noise.level, cascade.noise_range, left_alone, sides.num_turned, sides.num_doubled, after)
    for text in found:
        warnings.warn(text, DenoiseWarning, stacklevel=3)
    turned, coverage, confidence = (value[sides.face_id] for value in fused)
    mesh, filtered = source.with_positions(final), turned * sides.sign[:, None]
    result = DenoiseResult(
        mesh, final, source.face, filtered, coverage, confidence, noise, before, after, watch.seconds, found,
        *ended[-1], noisy_pos=source.pos, left_alone=left_alone,
    )  # fmt: skip
    _log.info("denoised %d faces in %s; %d iterations: %s", source.face.size(1), watch.seconds, *ended[-1])
    return result


def _loaded(weights: str | Path | FilteringNetwork | Cascade) -> Cascade:
    if isinstance(weights, FilteringNetwork):
        return Cascade([weights])
    return weights if isinstance(weights, Cascade) else load_cascade(weights)
