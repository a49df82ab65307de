"""Patches: the faces around a seed with their nearest faces, and their form as a PyG ``Data``.

======================  ================  =====================================================================
attribute               shape             meaning
======================  ================  =====================================================================
``x``                   (N, 3) float32    facet normals of the input, unit length
``y``                   (N, 3) float32    facet normals of the clean mesh, unit length (training only)
``pos``                 (N, 3) float32    face centroids, relative to that of the seed face; model units
``area``                (N,) float32      face areas, squared model units
``earlier``             (N, M, 3)         further facet normals, for the later networks of a cascade
``edge_index``          (2, E) long       nearest face (row 0) and centre (row 1)
``edge_attr``           (E,) long         rank of the nearest face by geodesic distance from its centre; 0 is the
                                          centre itself
``face_id``             (N,) long         row of each face in the mesh
``distance``            (N,) float32      geodesic distance from the seed face, model units
``seed_index``          (1,) long         row of the seed face: 0, shifted by PyG when patches are batched
======================  ================  =====================================================================

A level of k nearest faces has the edges with a rank below k (:func:`~dnf_pyg.nn.nearest_edges`), in whatever order the
edges are stored. The rank is called ``edge_attr`` since that is what ``Data.coalesce`` and ``Data.sort`` carry along.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.mesh import (
    DijkstraGrowth,
    FacetGraph,
    Growth,
    Topology,
    face_areas,
    face_centroids,
    filled_face_normals,
)
from dnf_pyg.mesh.dijkstra import nearest_within

__all__ = ["FaceFeatures", "Patch", "PatchExtractor", "patch_to_data", "patches_to_data"]

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


class FaceFeatures(NamedTuple):
    """What a network may see of the faces of a mesh.

    Attributes:
        normal: Facet normals, shape (F, 3), unit length.
        centroid: Face centroids, shape (F, 3), model units.
        area: Face areas, shape (F,), squared model units.
        earlier: Further facet normals, shape (F, M, 3): see :class:`~dnf_pyg.nn.Cascade`.
    """

    normal: Tensor
    centroid: Tensor
    area: Tensor
    earlier: Tensor | None = None

    @classmethod
    def from_mesh(cls, pos: Tensor, face: Tensor, earlier: Tensor | None = None) -> "FaceFeatures":
        """Compute the features of a mesh, pos (V, 3) and face (3, F), with further normals (F, M, 3).

        Faces without an area take the normal of their surroundings (:func:`~dnf_pyg.mesh.filled_face_normals`).

        Example:
            >>> FaceFeatures.from_mesh(torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), torch.tensor([[0], [1], [2]]))
            FaceFeatures(normal=tensor([[0., 0., 1.]]), centroid=..., area=tensor([3.]), earlier=None)
        """
        return cls(filled_face_normals(pos, face), face_centroids(pos, face), face_areas(pos, face), earlier)


def patch_to_data(patch: Patch, features: FaceFeatures, clean_normal: Tensor | None = None) -> Data:
    """Make the PyG ``Data`` of a patch, with the attributes that are listed at the top of this module.

    Differs: the clean normals are those of the same faces; the paper grows another patch on the clean mesh.

    Args:
        patch: Patch of the mesh.
        features: Features of all faces of the mesh.
        clean_normal: Facet normals of the whole clean mesh, shape (F, 3), unit length.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> data = patch_to_data(PatchExtractor(pos, face).extract(1), FaceFeatures.from_mesh(pos, face))
        >>> data.num_node_features, data.edge_index.tolist(), data.edge_attr.tolist()
        (3, [[0, 1, 1, 0], [0, 0, 1, 1]], [0, 1, 0, 1])
    """
    data = patches_to_data([patch], features)
    del data.batch
    if clean_normal is not None:
        data.y = clean_normal[patch.face_id].float()
    return data


def patches_to_data(patches: Sequence[Patch], features: FaceFeatures) -> Data:
    """Make one ``Data`` of many patches, at a cost that depends on their faces rather than their number.

    Args:
        patches: Patches of one mesh, at least one.
        features: Features of all faces of the mesh.

    Returns:
        The attributes of ``Batch.from_data_list`` of the single patches (:func:`patch_to_data`), among them ``batch``,
        the patch of each face, shape (N,) long.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> patch = PatchExtractor(pos, face, patch_size=1).extract(1)
        >>> patches_to_data([patch, patch], FaceFeatures.from_mesh(pos, face)).edge_index.tolist()
        [[0, 1], [0, 1]]
    """
    device = patches[0].neighbor.device
    size, width = torch.tensor([patch.neighbor.shape for patch in patches], device=device).t()
    first = size.cumsum(0) - size
    batch = torch.arange(len(patches), device=device).repeat_interleave(size)
    width = width[batch]
    centre = torch.arange(len(batch), device=device).repeat_interleave(width)
    rank = torch.arange(len(centre), device=device) - (width.cumsum(0) - width)[centre]
    neighbor = torch.cat([patch.neighbor.flatten() for patch in patches]).long()
    edge_index = torch.stack([neighbor + first[batch][centre], centre])
    known = neighbor >= 0
    if not known.all():
        edge_index, rank = edge_index[:, known], rank[known]
    face_id = torch.cat([patch.face_id for patch in patches])
    centroid = features.centroid[face_id]
    data = Data(
        x=features.normal[face_id].float(),
        pos=(centroid - centroid[first][batch]).float(),
        area=features.area[face_id].float(),
        edge_index=edge_index,
        edge_attr=rank,
        face_id=face_id,
        distance=torch.cat([patch.distance for patch in patches]),
        seed_index=first,
        batch=batch,
    )
    if features.earlier is not None:
        data.earlier = features.earlier[face_id].float()
    return data
