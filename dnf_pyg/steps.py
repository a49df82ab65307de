"""The steps that denoise a mesh: its normals are filtered and its vertices updated, on coarse versions first."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from dnf_pyg.filtering import filter_normals
from dnf_pyg.mesh import filled_face_normals
from dnf_pyg.mesh.coarse import coarsen
from dnf_pyg.mesh.local_noise import LocalNoise
from dnf_pyg.mesh.noise_level import NoiseEstimate
from dnf_pyg.mesh.normal_smoothing import smooth_normals
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.nn import Cascade, FilteringNetwork
from dnf_pyg.options import FilterOptions, UpdateOptions
from dnf_pyg.patches.fusion import FusedNormals
from dnf_pyg.progress import Progress, Stopwatch, part_of

__all__ = ["Steps"]

_TURN = 2.0  # root mean square of the tangent by which noise of one edge length turns an equilateral face
_SHARE = 0.16  # of the faces that a coarser version keeps: edges of 2.5 times the length
_MOST_SIGMA = 30.0  # standard deviations of the noise by which vertices move at most: scans reach 22
_FEWEST_FACES = 200  # of a coarser version; one with fewer has lost the shape
_LONGER = 1.25  # is the update to the more accurate normals of a later network


@dataclass(frozen=True)
class Steps:
    """Filter the normals of a mesh and move its vertices, from coarse versions to the mesh itself.

    Noise that is alike at neighbouring vertices is shape to a network that sees a few rings around a face. On a coarse
    version, where neighbours are farther apart, it is noise. So a mesh with such noise is decimated to a sixth of
    its faces, once or more; the coarsest version is denoised, and each finer one starts from its own vertices
    moved as those of the coarser one.

    Attributes:
        cascade: The networks.
        filtering: How facet normals are filtered.
        update: How vertices are moved.
        noise: Estimated noise of the mesh.
        num_passes: Number of times the mesh itself is filtered, each time its own result.
        progress: Called with the faces of the mesh itself done, over all passes and networks, and their total.
        watch: Takes the time of each step.
        ended: Called after each vertex update with the number of its iterations, and why no more ran.
    """

    cascade: Cascade
    filtering: FilterOptions
    update: UpdateOptions
    noise: NoiseEstimate
    num_passes: int
    progress: Progress
    watch: Stopwatch
    ended: Callable[[int, str], object]

    def __call__(
        self, pos: Tensor, face: Tensor, fixed: Tensor, topology: Topology, local: LocalNoise | None = None
    ) -> tuple[Tensor, FusedNormals]:
        """Return the positions (V, 3) and the filtered normals that they fit.

        Args:
            pos: Noisy vertex positions, (V, 3).
            face: Vertices of each face, (3, F).
            fixed: Vertices that stay in place, (V,) bool.
            topology: Connectivity of the mesh.
            local: Limits the movement of each vertex, and that to the planes of long triangles; no limit if not given.
        """
        return self._level(pos, face, fixed, topology, self.filtering.coarser_versions(self.noise.is_correlated), local)

    def _level(
        self,
        origin: Tensor,
        face: Tensor,
        fixed: Tensor,
        topology: Topology,
        num_coarser: int,
        local: LocalNoise | None = None,
    ) -> tuple[Tensor, FusedNormals]:
        pos = origin + torch.where(fixed[:, None], 0.0, self._coarse_move(origin, face, topology, num_coarser))
        networks = self.cascade.networks
        limit, trust = torch.tensor(self._limit, dtype=torch.float64), None
        if local is not None:
            trust = local.trust()
            unit = float(topology.mean_edge_length(origin)) or 1.0
            limit = (_MOST_SIGMA * local.sigma / unit).clamp(max=limit)
        start, normal = pos, torch.empty(0)
        most, stops_early = self.update.num_iterations, self.update.stops_early(self.noise.is_correlated)

        def ended(count: int, reason: str) -> None:
            nonlocal most
            if stops_early and row == 0:  # how later normals depend on the noise, the estimate of the error cannot see
                most = min(most, math.ceil(_LONGER * count))
            elif count == most < self.update.num_iterations:
                reason = f"{_LONGER:g} times as many as for the first network"
            self.ended(count, reason)

        for turn in range(self.num_passes):
            given = filled_face_normals(pos, face)
            most = self.update.num_iterations
            for row, net in enumerate(networks):
                number = turn * len(networks) + row
                fused = filter_normals(
                    net,
                    pos,
                    face,
                    replace(self.filtering, seed=(self.filtering.seed + number) % 2**63),
                    earlier=torch.stack([normal, given], dim=1) if row > 0 else None,
                    topology=topology,
                    progress=part_of(self.progress, number, self.num_passes * len(networks)),
                    watch=self.watch,
                )
                normal = smooth_normals(fused.normal.double(), pos, topology, *self._tolerances(net))
                self.watch.lap("fuse")
                pos = update_vertices(
                    start,
                    face,
                    normal,
                    most,
                    early_stopping=stops_early and row == 0,
                    max_move=limit,
                    origin=origin,
                    fixed=fixed,
                    weight=trust,
                    topology=topology,
                    ended=ended,
                )
                self.watch.lap("update")
        return pos, fused._replace(normal=normal.float())

    def _coarse_move(self, pos: Tensor, face: Tensor, topology: Topology, num_coarser: int) -> Tensor:
        """Displacements (V, 3) that a coarser version asks for; 0 where there is none that still has a shape."""
        unit = float(topology.mean_edge_length(pos))
        if not num_coarser or unit == 0 or face.size(1) * _SHARE < _FEWEST_FACES:
            return torch.zeros_like(pos)
        coarse = coarsen(pos, face, _SHARE)
        self.watch.lap("coarsen")
        if coarse.face.size(1) == 0:  # a soup of needles
            return torch.zeros_like(pos)
        free, below = torch.zeros(len(coarse.pos), dtype=torch.bool), Topology(coarse.face, len(coarse.pos))
        once = replace(self, num_passes=1, progress=lambda done, total: None)
        moved, _ = once._level(coarse.pos, coarse.face, free, below, num_coarser - 1)
        move = coarse.prolong(moved - coarse.pos)
        return move * (self._limit * unit / move.norm(dim=1, keepdim=True).clamp(min=1e-300)).clamp(max=1)

    def _tolerances(self, net: FilteringNetwork) -> tuple[float, float]:
        """Largest differences of the normals of a network from narrow and wide means that are smoothed, in degrees."""
        turned = math.degrees(_TURN * self.noise.level)
        tolerance = self.filtering.smoothed_share(self.noise.is_correlated, net.smoothing) * turned
        return tolerance, net.wide_smoothing * tolerance

    @property
    def _limit(self) -> float:
        """Largest displacement before it is multiplied by the strength, in mean edge lengths."""
        return self.update.max_move / self.update.strength if self.update.strength > 0 else 0.0
