"""Noisy mesh in, denoised mesh out: filter the facet normals, move the vertices."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.filtering import Progress, filter_normals
from dnf_pyg.mesh.adjacency import boundary_vertices
from dnf_pyg.mesh.geodesic import Growth
from dnf_pyg.mesh.noise_level import estimate_noise_level
from dnf_pyg.mesh.validate import validate_mesh
from dnf_pyg.mesh.vertex_update import flipped_faces, update_vertices, without_flips
from dnf_pyg.mesh.weld import weld
from dnf_pyg.nn import FilteringNetwork
from dnf_pyg.weights.load import DEFAULT_WEIGHTS, load_network

__all__ = ["FAST", "DenoiseResult", "denoise"]

FAST: Mapping[str, Any] = MappingProxyType({"min_coverage": 1, "neighbors": (10, 16, 24)})
"""Arguments that trade at most 0.2 degrees for about twice the speed: ``denoise(mesh, **FAST)``."""


@dataclass(frozen=True)
class DenoiseResult:
    """What :func:`denoise` returns.

    Attributes:
        mesh: The denoised mesh; all but its vertex positions is as in the input.
        normal: Filtered facet normals, (F, 3), unit length, that the vertices were moved to fit.
        coverage: Number of patches that each face lay in, (F,).
        confidence: How well these patches agree, (F,), up to 1.
        noise_level: Estimate for the input, in mean edge lengths.
        flipped_before: Faces of the input more than 90 degrees from their filtered normal.
        flipped_after: Such faces of the result.
        seconds: Time spent by stage.
        warnings: What the user should know about the result, a sentence each.
    """

    mesh: trimesh.Trimesh
    normal: Tensor
    coverage: Tensor
    confidence: Tensor
    noise_level: float
    flipped_before: int
    flipped_after: int
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def pos(self) -> Tensor:
        """Vertex positions of the denoised mesh, (V, 3) float64."""
        return torch.tensor(np.asarray(self.mesh.vertices), dtype=torch.float64)


def denoise(
    mesh: trimesh.Trimesh,
    weights: str | Path | FilteringNetwork = DEFAULT_WEIGHTS,
    *,
    strength: float = 1.0,
    max_move: float = float("inf"),
    num_iterations: int = 60,
    max_correlation: float = -0.03,
    repeat: int = 1,
    mask: Tensor | NDArray[np.bool_] | None = None,
    preserve_boundary: bool = False,
    growth: Growth | None = None,
    patch_size: int = 800,
    min_coverage: int = 2,
    neighbors: Sequence[int] | None = None,
    batch_size: int = 4,
    seed: int = 0,
    device: str | torch.device = "cpu",
    precision: torch.dtype = torch.float32,
    progress: Progress | None = None,
) -> DenoiseResult:
    """Denoise a triangle mesh.

    Copies of a vertex at one place (seams of textures, triangle soups) move together. The result moves, scales and
    turns with the mesh (turns: for weights with ``align``, else nearly).

    Args:
        mesh: The noisy mesh; it is not changed.
        weights: Name of packaged weights, a folder, a checkpoint (see :func:`load_network`), or a network.
        strength: Share of the way that vertices go, from 0 (the mesh stays as it is) to 1.
        max_move: Largest movement of a vertex, in mean edge lengths.
        num_iterations: Most iterations of the vertex update.
        max_correlation: The vertex update ends when neighbouring vertices have begun to move alike, by this correlation
            (:func:`~dnf_pyg.mesh.vertex_update.update_vertices`): that takes shape away, not noise. 1 runs all
            iterations, which suits noise that is alike at neighbouring vertices, as some scanners have it.
        repeat: Times that the network filters, each time its own result; 2 suits strong noise.
        mask: Vertices that may move, (V,) bool; all if not given.
        preserve_boundary: Leave vertices on open boundaries in place.
        growth: How a patch grows around its seed: ``DijkstraGrowth()``, the default, or ``HeatGrowth()``.
        patch_size: Faces per patch.
        min_coverage: Patches that every face lies in, at least.
        neighbors: Neighbours per face on each level of the network, spread over the nearest; all it knows if not given.
        batch_size: Patches per call of the network.
        seed: Seed of the choice of patches; the same seed gives the same result.
        device: Where the network runs.
        precision: ``torch.float32``, or ``torch.bfloat16`` on hardware that is faster with it.
        progress: Called with the number of faces covered so far and their total, over all repeats.

    Returns:
        The denoised mesh and what led to it.

    Raises:
        MeshError: If it is no ``trimesh.Trimesh``, or has no faces or coordinates that are not finite.
        WeightsError: If the weights cannot be loaded, or have another number of levels than ``neighbors``.
        ValueError: If an argument is out of range.
    """
    if not isinstance(mesh, trimesh.Trimesh):
        raise MeshError(
            f"Expected 'mesh' as a trimesh.Trimesh (got {type(mesh).__name__}): read it with trimesh.load_mesh or "
            "dnf_pyg.io.read_mesh(path).mesh"
        )
    mask = None if mask is None else torch.as_tensor(mask)
    _check(strength, repeat, mask, len(mesh.vertices))
    if batch_size < 1:
        raise ValueError(f"Expected 'batch_size' of at least 1 (got {batch_size})")
    if precision not in (torch.float32, torch.bfloat16):
        raise ValueError(f"Expected 'precision' torch.float32 or torch.bfloat16 (got {precision})")
    net = weights if isinstance(weights, FilteringNetwork) else load_network(weights)
    original = torch.tensor(np.asarray(mesh.vertices), dtype=torch.float64)
    face = torch.tensor(np.asarray(mesh.faces), dtype=torch.long).reshape(-1, 3).t().contiguous()
    validate_mesh(original, face)
    started = time.perf_counter()
    welded = weld(original, face)
    noise_level = estimate_noise_level(welded.pos, welded.face)
    fixed = _fixed_vertices(welded.vertex_id, welded.face, len(welded.pos), mask, preserve_boundary)
    seconds = {"prepare": time.perf_counter() - started, "patches": 0.0, "network": 0.0, "fuse": 0.0, "update": 0.0}
    num_faces = face.size(1)
    pos = welded.pos
    for turn in range(repeat):
        filtered = filter_normals(
            net,
            pos,
            welded.face,
            growth=growth,
            patch_size=patch_size,
            min_coverage=min_coverage,
            neighbors=neighbors,
            batch_size=batch_size,
            seed=seed + turn,
            device=device,
            precision=precision,
            progress=progress and _later(progress, turn * num_faces, repeat * num_faces),
        )
        started = time.perf_counter()
        normal = filtered.normal.double()
        limit = max_move / strength if strength > 0 else 0.0
        pos = update_vertices(
            welded.pos,
            welded.face,
            normal,
            num_iterations,
            max_correlation=max_correlation,
            max_move=limit,
            fixed=fixed,
        )
        seconds["update"] += time.perf_counter() - started
        for stage, spent in filtered.seconds.items():
            seconds[stage] += spent
    final = torch.where((pos != welded.pos).any(dim=1, keepdim=True), welded.pos.lerp(pos, strength), welded.pos)
    if 0 < strength < 1:  # halfway, a face may lie the wrong way round that does so at neither end
        final = without_flips(final, welded.pos, welded.face, normal)
    denoised = mesh.copy()
    denoised.vertices = final[welded.vertex_id].numpy()
    flipped = [int(flipped_faces(where, welded.face, normal).sum()) for where in (welded.pos, final)]
    return DenoiseResult(
        denoised,
        filtered.normal,
        filtered.coverage,
        filtered.confidence,
        noise_level,
        flipped[0],
        flipped[1],
        seconds,
        _warnings(noise_level, net.noise_range, flipped[1]),
    )


def _check(strength: float, repeat: int, mask: Tensor | None, num_vertices: int) -> None:
    if not 0 <= strength <= 1:
        raise ValueError(f"Expected 'strength' from 0 to 1 (got {strength})")
    if repeat < 1:
        raise ValueError(f"Expected 'repeat' of at least 1 (got {repeat})")
    if mask is not None and (mask.shape != (num_vertices,) or mask.dtype != torch.bool):
        raise ValueError(f"Expected 'mask' of shape [{num_vertices}] and bool (got {list(mask.shape)} {mask.dtype})")


def _fixed_vertices(
    vertex_id: Tensor, face: Tensor, num_vertices: int, mask: Tensor | None, preserve_boundary: bool
) -> Tensor:
    """Distinct vertices that stay, (U,): on a boundary, or none of whose copies is in the mask."""
    fixed = torch.zeros(num_vertices, dtype=torch.bool)
    if mask is not None:
        fixed[:] = True
        fixed[vertex_id[mask]] = False
    return fixed | boundary_vertices(face, num_vertices) if preserve_boundary else fixed


def _warnings(noise_level: float, noise_range: tuple[float, float] | None, num_flipped: int) -> list[str]:
    found = []
    lowest, highest = noise_range or (0.0, float("inf"))
    if noise_level < lowest:
        found.append(
            f"The noise level of about {noise_level:.3f} mean edge lengths is below {lowest}, the least that the "
            "weights were trained on: fine detail may be smoothed away; a lower strength keeps it."
        )
    if noise_level > highest:
        found.append(
            f"The noise level of about {noise_level:.2f} mean edge lengths is above {highest}, the most that the "
            "weights were trained on: repeat the filter, or train on such noise."
        )
    if num_flipped:
        found.append(
            f"Faces that lie the wrong way round, folds of the input that could not be unfolded: {num_flipped}."
        )
    return found


def _later(progress: Progress, done_before: int, total: int) -> Progress:
    return lambda done, _: progress(done_before + done, total)
