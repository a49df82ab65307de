"""Connectivity of a mesh, computed once for all the functions that need it."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.adjacency import one_ring_csr, vertex_faces
from dnf_pyg.mesh.geometry import edge_lengths, edges

__all__ = ["Topology"]


class Topology:
    """Edges and neighbouring faces of a mesh; edges and faces around vertices are computed once, and kept.

    Vertices that move leave the topology as it is: make one object for a mesh and pass it to every function that takes
    it. The mesh has to be sound (:func:`~dnf_pyg.mesh.validate_mesh`); these functions do not validate it again.

    Args:
        face: Vertices of each face, shape (3, F); it must not change afterwards.
        num_vertices: Number of vertices V.

    Example:
        >>> import torch
        >>> topology = Topology(torch.tensor([[0, 1], [1, 3], [2, 2]]), num_vertices=4)
        >>> topology.edges.shape, topology.edges is topology.edges
        (torch.Size([2, 5]), True)
    """

    def __init__(self, face: Tensor, num_vertices: int) -> None:
        self.face = face.cpu()
        self.num_vertices = num_vertices

    @cached_property
    def edges(self) -> Tensor:
        """Undirected edges, shape (2, U), see :func:`~dnf_pyg.mesh.edges`."""
        return edges(self.face)

    @cached_property
    def vertex_faces(self) -> tuple[Tensor, Tensor]:
        """Faces around each vertex, see :func:`~dnf_pyg.mesh.vertex_faces`."""
        return vertex_faces(self.face, self.num_vertices)

    def one_ring(self) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """Find the faces around each face, ``neighbor[ptr[f]:ptr[f + 1]]``, as ``(ptr, neighbor)``.

        They take more memory than all else of a mesh, and are not kept.
        """
        return one_ring_csr(self.face, *self.vertex_faces)

    def mean_edge_length(self, pos: Tensor) -> Tensor:
        """Compute the mean length of the undirected edges, see :func:`~dnf_pyg.mesh.mean_edge_length`.

        Args:
            pos: Vertex positions, shape (V, 3), model units.
        """
        length = edge_lengths(pos, self.edges.to(pos.device))
        return length.mean().to(pos.dtype) if length.numel() else pos.new_zeros(())
