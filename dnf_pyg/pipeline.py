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
from dnf_pyg.io.inputs import as_input, as_mask
from dnf_pyg.mesh import boundary_vertices, validate_mesh
from dnf_pyg.mesh.noise_level import estimate_noise
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_update import flipped_faces, without_flips
from dnf_pyg.mesh.weld import weld
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
    cascade = _loaded(weights)
    validate_mesh(source.pos, source.face)
    movable = as_mask(mask, len(source.pos))
    start, face, vertex_id = weld(source.pos, source.face)
    topology = Topology(face, len(start))
    noise = estimate_noise(start, face, topology)
    fixed = torch.ones(len(start), dtype=torch.bool)
    fixed[vertex_id[movable]] = False  # a vertex stays where none of its copies may move
    if update.preserve_boundary:
        fixed |= boundary_vertices(face, len(start))
    watch.lap("prepare")
    ended: list[tuple[int, str]] = []
    bar = nullcontext(progress) if callable(progress) else progress_bar("filtering", "face", hidden=not progress)
    with bar as report:
        steps = Steps(
            cascade, filtering, update, noise.is_correlated, num_passes, report, watch,
            ended=lambda *told: ended.append(told),
        )  # fmt: skip
        pos, fused = steps(start, face, fixed, topology)
    normal = fused.normal.double()
    final = torch.where((pos != start).any(dim=1, keepdim=True), start.lerp(pos, update.strength), start)
    if 0 < update.strength < 1:  # halfway, a face may be flipped that is so at neither end
        final = without_flips(final, start, face, normal)
    before, after = (int(flipped_faces(where, face, normal).sum()) for where in (start, final))
    final = final[vertex_id]
    found = _warnings(noise.level, cascade.noise_range, after)
    for text in found:
        warnings.warn(text, DenoiseWarning, stacklevel=3)
    result = DenoiseResult(
        source.with_positions(final), final, source.face, *fused, noise, before, after, watch.seconds, found,
        *ended[-1], noisy_pos=source.pos,
    )  # fmt: skip
    _log.info("denoised %d faces in %s; %d iterations: %s", source.face.size(1), watch.seconds, *ended[-1])
    return result


def _loaded(weights: str | Path | FilteringNetwork | Cascade) -> Cascade:
    if isinstance(weights, FilteringNetwork):
        return Cascade([weights])
    return weights if isinstance(weights, Cascade) else load_cascade(weights)


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
