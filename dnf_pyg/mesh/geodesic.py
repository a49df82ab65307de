"""Geodesic distance between faces: the facet graph, its K nearest faces, and the growth of patches."""

import threading
from typing import NamedTuple, Protocol, Self

import numpy as np
import torch
from numpy.typing import NDArray
from potpourri3d import MeshHeatMethodDistanceSolver
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh.adjacency import one_ring_csr
from dnf_pyg.mesh.dijkstra import nearest_of_all, nearest_of_one
from dnf_pyg.mesh.geometry import face_centroids, mean_edge_length
from dnf_pyg.mesh.validate import validate_mesh

__all__ = ["BoundDijkstra", "BoundGrowth", "DijkstraGrowth", "FacetGraph", "Growth", "HeatGrowth", "nearest_faces"]

_STEPS = 2**16  # steps of length per mean edge length
_LONGEST = 2**30  # steps; a longer arc (16,384 mean edge lengths) counts as this long


class FacetGraph(NamedTuple):
    """Graph of the faces that share a vertex, with the distances of their centroids, compressed by row.

    Lengths are whole steps, 1/65536 of the mean edge length, at least 1: geodesic distances are then exact
    sums, the same on every machine and for every order of summation, at any size of the model.

    Attributes:
        ptr: Row limits, shape (F + 1,) int64.
        neighbor: Face at the other end of each arc, shape (E,) int32.
        length: Length of each arc, shape (E,) int32, steps.
        step: Length of one step, model units.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> FacetGraph.from_mesh(pos, torch.tensor([[0, 1], [1, 3], [2, 2]])).neighbor
        array([1, 0], dtype=int32)
    """

    ptr: NDArray[np.int64]
    neighbor: NDArray[np.int32]
    length: NDArray[np.int32]
    step: float

    @classmethod
    def from_mesh(cls, pos: Tensor, face: Tensor) -> Self:
        """Build the graph of a mesh.

        Args:
            pos: Vertex positions, shape (V, 3), model units.
            face: Vertices of each face, shape (3, F).

        Raises:
            MeshError: See :func:`~dnf_pyg.mesh.validate_mesh`.
        """
        validate_mesh(pos, face)
        ptr, neighbor = one_ring_csr(face, pos.size(0))
        pos = pos.double() - pos.double().mean(dim=0)
        size = pos.abs().amax().item() or 1.0
        pos = pos / size
        step = mean_edge_length(pos, face).item() / _STEPS or 1.0
        return cls(ptr, neighbor, _arc_lengths(face_centroids(pos, face).numpy(), ptr, neighbor, step), step * size)

    @property
    def num_faces(self) -> int:
        """Number of faces F."""
        return len(self.ptr) - 1

    @property
    def shift(self) -> int:
        """Bits that a face id takes in a key of the searches."""
        return max(int(self.num_faces - 1).bit_length(), 1)


def _arc_lengths(
    centroid: NDArray[np.float64], ptr: NDArray[np.int64], neighbor: NDArray[np.int32], step: float
) -> NDArray[np.int32]:
    """Distance of the two centroids of each arc in steps, worked out in slices to stay small."""
    length = np.empty(len(neighbor), np.int32)
    for first in range(0, len(ptr) - 1, 65536):
        row = ptr[first : first + 65537]
        arc = slice(row[0], row[-1])
        centre = np.repeat(centroid[first : first + 65536], np.diff(row), axis=0)
        distance = np.linalg.norm(centroid[neighbor[arc]] - centre, axis=1)
        length[arc] = np.clip(np.rint(distance / step), 1, _LONGEST)
    return length


def nearest_faces(graph: FacetGraph, k: int) -> Tensor:
    """Find the K nearest faces of every face.

    Args:
        graph: Facet graph of the mesh.
        k: Number of faces kept, the face itself included.

    Returns:
        Face ids, shape (F, K) int32: the face itself, then by rising geodesic distance, equal distances by
        face id; -1 where a component has fewer than K faces.

    Raises:
        ValueError: If ``k`` is not positive.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> nearest_faces(FacetGraph.from_mesh(pos, torch.tensor([[0, 1], [1, 3], [2, 2]])), k=3)
        tensor([[ 0,  1, -1],
                [ 1,  0, -1]], dtype=torch.int32)
    """
    if k < 1:
        raise ValueError(f"Expected 'k' of at least 1 (got {k})")
    out = np.empty((graph.num_faces, k), np.int32)
    nearest_of_all(graph.ptr, graph.neighbor, graph.length, k, graph.shift, 0, graph.num_faces, out)
    return torch.from_numpy(out)


class BoundGrowth(Protocol):
    """A growth that knows its mesh."""

    def grow(self, seed: int, size: int) -> tuple[Tensor, Tensor]:
        """Find the faces nearest to a seed.

        Args:
            seed: Face to start from.
            size: Number of faces wanted, the seed included.

        Returns:
            ``(face_id, distance)``: shapes (n,) long and (n,) float32 (model units), the seed first, then by
            rising distance, equal distances by face id; n < ``size`` where the component of the seed is smaller.
        """
        ...


class Growth(Protocol):
    """How a patch grows from its seed; chosen by class."""

    def bind(self, pos: Tensor, face: Tensor, graph: FacetGraph) -> BoundGrowth:
        """Prepare for one mesh.

        Args:
            pos: Vertex positions, shape (V, 3), model units.
            face: Vertices of each face, shape (3, F).
            graph: Facet graph of the same mesh.
        """
        ...


class DijkstraGrowth:
    """Grow along shortest paths over the centroids of faces that share a vertex: the cost depends on the patch only.

    Differs: the paper measures with the heat method, see :class:`HeatGrowth`; about 98% of the faces are the same.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [3, 3, 0]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> DijkstraGrowth().bind(pos, face, FacetGraph.from_mesh(pos, face)).grow(1, size=2)[0]
        tensor([1, 0])
    """

    def bind(self, pos: Tensor, face: Tensor, graph: FacetGraph) -> BoundGrowth:
        """Prepare for one mesh, see :meth:`Growth.bind`."""
        return BoundDijkstra(graph)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


class BoundDijkstra:
    """Growth by Dijkstra's search on one facet graph; see :class:`DijkstraGrowth`. Threads may share it."""

    def __init__(self, graph: FacetGraph) -> None:
        self.graph = graph
        self._scratch = _Scratch(graph.num_faces)

    def grow(self, seed: int, size: int) -> tuple[Tensor, Tensor]:
        """Find the faces nearest to a seed, see :meth:`BoundGrowth.grow`."""
        ptr, neighbor, length, step = self.graph
        shift = self.graph.shift
        size = min(size, self.graph.num_faces)
        own = self._scratch
        own.serial += 1
        key = nearest_of_one(ptr, neighbor, length, seed, size, shift, own.best, own.stamp, own.serial)
        distance = ((key >> shift) * step).astype(np.float32)
        return torch.from_numpy(key & ((1 << shift) - 1)), torch.from_numpy(distance)


class _Scratch(threading.local):  # arrays of one thread that every search uses again
    def __init__(self, num_faces: int) -> None:
        self.best = np.empty(num_faces, np.int64)
        self.stamp = np.zeros(num_faces, np.int32)
        self.serial = 0


class HeatGrowth:
    """Grow by the heat method from the three vertices of the seed: the paper's way; the cost grows with the mesh.

    The distance of a face is that of its nearest vertex, as in the paper, which takes the smallest of nine.
    Source: Li et al. 2020, Sec. 3.2; Crane et al. 2013, with the robust Laplacian of Sharp and Crane 2020.

    Raises:
        MeshError: From ``bind`` and ``grow``, if the solver refuses the mesh or finds no finite distance.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [3, 3, 0]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> HeatGrowth().bind(pos, face, FacetGraph.from_mesh(pos, face)).grow(1, size=2)[0]
        tensor([1, 0])
    """

    def bind(self, pos: Tensor, face: Tensor, graph: FacetGraph) -> BoundGrowth:
        """Prepare for one mesh, see :meth:`Growth.bind`."""
        return _BoundHeat(pos, face, graph)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


class _BoundHeat:
    def __init__(self, pos: Tensor, face: Tensor, graph: FacetGraph) -> None:
        used, corner = face.t().unique(return_inverse=True)  # the solver takes no vertex without a face
        self._face = corner.numpy()
        position = pos[used].double() - pos[used].double().mean(dim=0)
        self._scale = graph.step * _STEPS
        links = csr_array((graph.length, graph.neighbor, graph.ptr), shape=(graph.num_faces, graph.num_faces))
        self._component = connected_components(links, directed=False)[1]
        try:
            self._solver = MeshHeatMethodDistanceSolver((position / self._scale).numpy(), self._face)
        except RuntimeError as error:
            raise _heat_error(error) from error

    def grow(self, seed: int, size: int) -> tuple[Tensor, Tensor]:
        try:
            at_vertex = self._solver.compute_distance_multisource(self._face[seed])
        except RuntimeError as error:
            raise _heat_error(error) from error
        if not np.isfinite(at_vertex).all():
            raise _heat_error("distances that are not finite")
        distance = at_vertex[self._face].min(axis=1).clip(min=0)
        distance[self._component != self._component[seed]] = np.inf
        distance[seed] = -1
        face_id = np.argsort(distance, kind="stable")[: min(size, np.isfinite(distance).sum())]
        length = (distance[face_id].clip(min=0) * self._scale).astype(np.float32)
        return torch.from_numpy(face_id), torch.from_numpy(length)


def _heat_error(error: object) -> MeshError:
    return MeshError(f"Expected a mesh that the heat method can solve (got '{error}'). Use DijkstraGrowth instead.")
