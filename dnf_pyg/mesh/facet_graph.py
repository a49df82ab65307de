"""The facet graph: faces that share a vertex, with the distances of their centroids; K nearest faces."""

import threading
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.dijkstra import nearest_of_all
from dnf_pyg.mesh.geometry import face_centroids
from dnf_pyg.mesh.topology import Topology
from dnf_pyg.mesh.validate import validate_mesh
from dnf_pyg.mesh.vectors import square_distance

__all__ = ["FacetGraph", "Scratch", "nearest_faces"]

_STEPS = 2**16  # steps of length per mean edge length
_LONGEST = 2**30  # steps; a longer arc (16,384 mean edge lengths) counts as this long


class Scratch(threading.local):
    """Arrays of one thread that every search on a graph uses again.

    An entry of ``value`` counts where ``stamp`` holds the serial number of the search, so nothing has to be cleared.
    """

    def __init__(self, num_faces: int) -> None:
        self.value = np.empty(num_faces, np.int64)
        self.stamp = np.zeros(num_faces, np.int32)
        self.serial = 0

    def begin(self) -> tuple[NDArray[np.int64], NDArray[np.int32], int]:
        """Begin a search: ``value``, ``stamp`` and its serial number."""
        self.serial += 1
        return self.value, self.stamp, self.serial


@dataclass(frozen=True, eq=False)
class FacetGraph:
    """Graph of the faces that share a vertex, with the distances of their centroids, compressed by row.

    Lengths are integers of at least 1, in steps of 1/65536 of the mean edge length: geodesic distances are then exact
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
    def from_mesh(cls, pos: Tensor, face: Tensor, topology: Topology | None = None) -> Self:
        """Build the graph of a mesh.

        Args:
            pos: Vertex positions, shape (V, 3), model units.
            face: Vertices of each face, shape (3, F).
            topology: Connectivity of the mesh, which then is not validated; computed if not given.

        Raises:
            MeshError: See :func:`~dnf_pyg.mesh.validate_mesh`.
        """
        if topology is None:
            validate_mesh(pos, face)
            topology = Topology(face, pos.size(0))
        ptr, neighbor = topology.one_ring()
        pos, face = pos.detach().cpu().double(), topology.face
        pos = pos - pos.mean(dim=0)
        size = pos.abs().amax().item() or 1.0
        pos = pos / size
        step = topology.mean_edge_length(pos).item() / _STEPS or 1.0
        return cls(ptr, neighbor, _arc_lengths(face_centroids(pos, face).numpy(), ptr, neighbor, step), step * size)

    @cached_property
    def scratch(self) -> Scratch:
        """Arrays that searches on this graph use again."""
        return Scratch(self.num_faces)

    @property
    def num_faces(self) -> int:
        """Number of faces F."""
        return len(self.ptr) - 1

    @property
    def mean_edge_length(self) -> float:
        """Mean length of the edges of the mesh, model units; 1/65536 of it is a step."""
        return self.step * _STEPS

    @property
    def shift(self) -> int:
        """Number of bits of a face id in the keys of the searches."""
        return max(int(self.num_faces - 1).bit_length(), 1)


@njit(cache=True, nogil=True)
def _arc_lengths(
    centroid: NDArray[np.float64], ptr: NDArray[np.int64], neighbor: NDArray[np.int32], step: float
) -> NDArray[np.int32]:
    """Distance between the two centroids of each arc in steps."""
    length = np.empty(len(neighbor), np.int32)
    for f in range(len(ptr) - 1):
        for entry in range(ptr[f], ptr[f + 1]):
            distance = np.sqrt(square_distance(centroid, f, neighbor[entry]))
            length[entry] = min(max(np.rint(distance / step), 1), _LONGEST)
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
        raise ValueError(f"Expected 'k' of at least 1 (got {k}). Raise it.")
    out = np.empty((graph.num_faces, k), np.int32)
    nearest_of_all(graph.ptr, graph.neighbor, graph.length, k, graph.shift, 0, graph.num_faces, out)
    return torch.from_numpy(out)
