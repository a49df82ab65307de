"""Patches: the faces around a seed with their nearest faces, and their form as a PyG ``Data``.

======================  ================  =====================================================================
attribute               shape             meaning
======================  ================  =====================================================================
``normal``              (N, 3) float32    facet normals of the input, unit length
``clean_normal``        (N, 3) float32    facet normals of the target, unit length (training only)
``face_id``             (N,) long         row of each face in the mesh
``distance``            (N,) float32      geodesic distance from the seed, model units
``seed_index``          (1,) long         row of the seed: 0, moved on by PyG when patches are batched
``surface``             (N, 4) float32    centroid of each face, from that of the seed, and its area; model units
                                          (for networks that see it)
``edge_index``          (2, E) long       nearest face (row 0) and centre (row 1), sorted by centre, within a
                                          centre by geodesic distance, the centre itself first
======================  ================  =====================================================================

Where every face has K nearest faces E = N K, and a level of k of them is ``edge_index.view(2, N, K)[:, :, :k]``.
"""

from typing import NamedTuple

import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.mesh import DijkstraGrowth, FacetGraph, Growth, Topology, face_areas, face_centroids
from dnf_pyg.mesh.dijkstra import nearest_within

__all__ = ["Patch", "PatchExtractor", "face_surface", "patch_to_data"]

_MAX_PATCH_SIZE = 2**15 - 1  # rows are stored as int16


class Patch(NamedTuple):
    """The faces around a seed.

    Attributes:
        face_id: Rows of the faces in the mesh, shape (N,) long, the seed first, by rising distance.
        neighbor: Nearest faces of each face as rows of the patch, shape (N, K) int16, the face itself first,
            by rising geodesic distance along paths inside the patch, padded with -1.
        distance: Geodesic distance from the seed, shape (N,) float32, model units.
    """

    face_id: Tensor
    neighbor: Tensor
    distance: Tensor


class PatchExtractor:
    """Cut patches out of one mesh; threads may share it.

    Source: Li et al. 2020, Sec. 3.2.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).
        growth: How a patch grows; :class:`~dnf_pyg.mesh.DijkstraGrowth` if not given.
        patch_size: Faces per patch N; a patch is smaller where the component of its seed is.
        k: Nearest faces kept for each face, itself included.
        topology: Connectivity of the mesh, which then is not validated; computed if not given.

    Raises:
        ValueError: If ``patch_size`` is not from 1 to 32767 or ``k`` not positive.
        MeshError: See :func:`~dnf_pyg.mesh.validate_mesh`.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> PatchExtractor(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]), k=2).extract(1).neighbor
        tensor([[0, 1],
                [1, 0]], dtype=torch.int16)
    """

    def __init__(
        self,
        pos: Tensor,
        face: Tensor,
        growth: Growth | None = None,
        patch_size: int = 800,
        k: int = 50,
        topology: Topology | None = None,
    ) -> None:
        if not 1 <= patch_size <= _MAX_PATCH_SIZE:
            raise ValueError(f"Expected 'patch_size' from 1 to {_MAX_PATCH_SIZE} (got {patch_size}). Change it.")
        if k < 1:
            raise ValueError(f"Expected 'k' of at least 1 (got {k}). Raise it.")
        self.patch_size = patch_size
        self.k = k
        self.graph = FacetGraph.from_mesh(pos, face, topology)
        self.growth = (growth or DijkstraGrowth()).bind(pos, face, self.graph)

    @property
    def num_faces(self) -> int:
        """Faces of the mesh F."""
        return self.graph.num_faces

    def extract(self, seed: int) -> Patch:
        """Cut out the patch around a seed face.

        Args:
            seed: Row of the seed in the mesh.

        Raises:
            ValueError: If the mesh has no such face.
        """
        if not 0 <= seed < self.num_faces:
            raise ValueError(f"Expected 'seed' from 0 to {self.num_faces - 1} (got {seed}). Name a face of the mesh.")
        face_id, distance = self.growth.grow(seed, self.patch_size)
        graph, k = self.graph, min(self.k, len(face_id))
        table = nearest_within(
            graph.ptr, graph.neighbor, graph.length, face_id.numpy(), k, graph.shift, *graph.scratch.begin()
        )
        return Patch(face_id, torch.from_numpy(table), distance)


def face_surface(pos: Tensor, face: Tensor) -> Tensor:
    """Compute centroid and area of each face.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Shape (F, 4), model units and their square.

    Example:
        >>> face_surface(torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), torch.tensor([[0], [1], [2]]))
        tensor([[1.0000, 0.6667, 0.0000, 3.0000]])
    """
    return torch.cat([face_centroids(pos, face), face_areas(pos, face).unsqueeze(1)], dim=1)


def patch_to_data(
    patch: Patch, normal: Tensor, clean_normal: Tensor | None = None, surface: Tensor | None = None
) -> Data:
    """Put a patch into the form that the network takes (table at the top of this module).

    Args:
        patch: Patch of the mesh.
        normal: Facet normals of the whole mesh, shape (F, 3), unit length (no zeros: see
            :func:`~dnf_pyg.mesh.filled_face_normals`).
        clean_normal: Facet normals of the whole clean mesh, shape (F, 3), unit length.
        surface: Centroid and area of each face of the whole mesh (:func:`face_surface`), shape (F, 4).

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> patch = PatchExtractor(pos, torch.tensor([[0, 1], [1, 3], [2, 2]])).extract(1)
        >>> patch_to_data(patch, torch.tensor([[0.0, 0, 1], [0, 0, 1]])).edge_index
        tensor([[0, 1, 1, 0],
                [0, 0, 1, 1]])
    """
    num_faces, k = patch.neighbor.shape
    centre = torch.arange(num_faces).repeat_interleave(k)
    edge_index = torch.stack([patch.neighbor.flatten().long(), centre])
    if bool((patch.neighbor[:, -1] < 0).any()):
        edge_index = edge_index[:, edge_index[0] >= 0]
    data = Data(
        normal=normal[patch.face_id].float(),
        edge_index=edge_index,
        face_id=patch.face_id,
        distance=patch.distance,
        seed_index=torch.zeros(1, dtype=torch.long),
        num_nodes=num_faces,
    )
    if clean_normal is not None:
        data.clean_normal = clean_normal[patch.face_id].float()
    if surface is not None:
        centroid, area = surface[patch.face_id].split([3, 1], dim=1)
        data.surface = torch.cat([centroid - centroid[:1], area], dim=1).float()
    return data
