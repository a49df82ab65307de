"""The finest detail of a mesh, from which its noise is estimated."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.alternation import local_alternation
from dnf_pyg.mesh.flatness import PairDeviations, pair_deviations
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.vertex_graph import lazy_walk, smoothed_normals, walk_differences

__all__ = ["Detail"]

_COLUMNS = 4  # of white noise


class Detail:
    """What filters and pairs of faces tell of the detail of a mesh, computed once for all estimates of its noise.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        topology: Connectivity of the mesh; computed if not given.

    Attributes:
        unit: Mean edge length, model units; 1 if it is 0.
        used: Vertices that have a face, (U,).
        pos: Positions relative to the mean of those of used vertices, (V, 3) float64, mean edge lengths.
        face: Vertices of each face, (3, F).
        edge: Undirected edges, (2, E).
        walk: Lazy random walk on the vertices, (V, V), see :func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`.
        normal: Directions along which detail is measured, (V, 3), unit length.

    Example:
        >>> import torch
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> detail = Detail(pos, face)
        >>> round(detail.unit, 4), detail.differences(1).shape, len(detail.pairs.deviation)
        (1.4142, (3, 7), 0)
    """

    def __init__(self, pos: Tensor, face: Tensor, topology: Topology | None = None) -> None:
        pos, face = pos.detach().cpu().double(), face.cpu()
        topology = topology or Topology(face, len(pos))
        self.face = face.numpy()
        self.used = np.unique(self.face)
        self.unit = float(topology.mean_edge_length(pos)) or 1.0
        centre = pos[self.used].mean(dim=0) if len(self.used) else 0.0
        self.pos = ((pos - centre) / self.unit).numpy()
        self.edge = topology.edges
        self.walk = lazy_walk(self.edge, len(pos))
        self.normal = smoothed_normals(self.walk, pos, face)
        noise = np.random.default_rng(0).standard_normal((len(pos), _COLUMNS))
        self._differences = [np.concatenate([self.pos, noise], axis=1)]

    def differences(self, num_steps: int) -> NDArray[np.float64]:
        """Filter the positions and four columns of white noise by (I - S)^n with the lazy random walk S, (V, 7)."""
        while len(self._differences) <= num_steps:
            self._differences.append(walk_differences(self.walk, self._differences[-1], 1))
        return self._differences[num_steps]

    def along(self, num_steps: int) -> NDArray[np.float64]:
        """Measure the filtered positions along the normals, (V,), mean edge lengths."""
        return (self.differences(num_steps)[:, :3] * self.normal).sum(axis=1)

    def white(self, num_steps: int) -> NDArray[np.float64]:
        """Filtered white noise of unit variance, (V, 4)."""
        return self.differences(num_steps)[:, 3:]

    @cached_property
    def pairs(self) -> PairDeviations:
        """Deviations of pairs of adjacent faces from a plane, mean edge lengths."""
        return pair_deviations(self.pos, self.face)

    @cached_property
    def alternation(self) -> NDArray[np.float64]:
        """How much the detail alternates around each vertex, as noise does, (V,)."""
        return local_alternation(self.walk, self.along(2), self.white(2))
