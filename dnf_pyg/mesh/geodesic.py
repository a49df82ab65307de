"""Growth of a patch from its seed face by geodesic distance."""

from typing import Protocol

import numpy as np
import torch
from potpourri3d import MeshHeatMethodDistanceSolver
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh.dijkstra import nearest_of_one
from dnf_pyg.mesh.facet_graph import FacetGraph

__all__ = ["GROWTHS", "BoundDijkstra", "BoundGrowth", "DijkstraGrowth", "Growth", "HeatGrowth"]


class BoundGrowth(Protocol):
    """A growth that has been bound to a mesh."""

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
    """Way in which a patch grows from its seed."""

    def bind(self, pos: Tensor, face: Tensor, graph: FacetGraph) -> BoundGrowth:
        """Prepare for one mesh.

        Args:
            pos: Vertex positions, shape (V, 3), model units.
            face: Vertices of each face, shape (3, F).
            graph: Facet graph of the same mesh.
        """
        ...


class DijkstraGrowth:
    """Grow along shortest paths over the centroids of faces that share a vertex; the cost depends on the patch only.

    Differs: the paper uses the heat method, see :class:`HeatGrowth`; about 98% of the faces of a patch are the same.

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

    def grow(self, seed: int, size: int) -> tuple[Tensor, Tensor]:
        """Find the faces nearest to a seed, see :meth:`BoundGrowth.grow`."""
        graph, shift = self.graph, self.graph.shift
        size = min(size, graph.num_faces)
        key = nearest_of_one(graph.ptr, graph.neighbor, graph.length, seed, size, shift, *graph.scratch.begin())
        distance = ((key >> shift) * graph.step).astype(np.float32)
        return torch.from_numpy(key & ((1 << shift) - 1)), torch.from_numpy(distance)


class HeatGrowth:
    """Grow by the heat method from the three vertices of the seed, as the paper does; the cost grows with the mesh.

    The distance of a face is that of its nearest vertex: the smallest of the nine distances between vertices.
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
        used, corner = face.cpu().t().unique(return_inverse=True)  # the solver takes no vertex without a face
        self._face = corner.numpy()
        position = pos.detach().cpu()[used].double()
        position -= position.mean(dim=0)
        self._scale = graph.mean_edge_length
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


GROWTHS: dict[str, type[Growth]] = {"dijkstra": DijkstraGrowth, "heat": HeatGrowth}
"""Ways to grow by name."""
