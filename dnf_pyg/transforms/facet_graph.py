"""The facet graph of a mesh as PyG data."""

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import BaseTransform

from dnf_pyg.mesh import FacetGraph, face_areas, face_centroids, filled_face_normals, nearest_faces

__all__ = ["ToFacetGraph"]


class ToFacetGraph(BaseTransform):
    """Convert a mesh ``Data(pos, face)`` to its facet graph, whose nodes are the faces.

    The result has the facet normals ``x``, the centroids ``pos``, the areas ``area``, and edges from the K nearest
    faces of each face by geodesic distance (row 0) to the face (row 1), with the rank of the neighbour as
    ``edge_attr`` (0: the face itself). Where the mesh has ``clean_pos``, the clean facet normals are ``y``.

    Ranks are integers: transforms of PyG that compute edge attributes, such as ``Distance``, need ``cat=False``, since
    otherwise they round them to the type of the ranks.

    Args:
        k: Nearest faces of each face, the face itself included; fewer in a smaller component.

    Raises:
        ValueError: If ``k`` is not positive.
        MeshError: When applied, see :func:`~dnf_pyg.mesh.validate_mesh`.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> ToFacetGraph(k=2)(Data(pos=pos, face=torch.tensor([[0, 1], [1, 3], [2, 2]])))
        Data(x=[2, 3], edge_index=[2, 4], edge_attr=[4], pos=[2, 3], area=[2])
    """

    def __init__(self, k: int = 50) -> None:
        if k < 1:
            raise ValueError(f"Expected 'k' of at least 1 (got {k}). Raise it.")
        self.k = k

    def forward(self, data: Data) -> Data:
        """Convert a mesh."""
        nearest = nearest_faces(FacetGraph.from_mesh(data.pos, data.face), self.k).long().to(data.pos.device)
        centre, rank = (nearest >= 0).nonzero(as_tuple=True)
        graph = Data(
            x=filled_face_normals(data.pos, data.face).float(),
            edge_index=torch.stack([nearest[centre, rank], centre]),
            edge_attr=rank,
            pos=face_centroids(data.pos, data.face).float(),
            area=face_areas(data.pos, data.face).float(),
        )
        if "clean_pos" in data:
            graph.y = filled_face_normals(data.clean_pos, data.face).float()
        return graph

    def __repr__(self) -> str:
        return f"{type(self).__name__}(k={self.k})"
