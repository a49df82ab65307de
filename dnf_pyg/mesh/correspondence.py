"""Faces of two versions of a mesh that correspond."""

import torch
from torch import Tensor

from dnf_pyg.mesh.geometry import face_centroids, mean_edge_length
from dnf_pyg.mesh.weld import coincident_rows

__all__ = ["corresponding_faces"]

_FAR = 2.0  # mean edge lengths: noise does not move a face that far
_FEW = 0.05  # share of the faces that may be far from their counterpart all the same


def corresponding_faces(pos: Tensor, face: Tensor, other_pos: Tensor, other_face: Tensor) -> Tensor:
    """Find the face of another version of a mesh that corresponds to each face.

    Usually, both list their faces in the same order. If the other one lists faces of the same vertices in another
    order, those of the same vertices correspond. Otherwise, if many faces are far from the one in their place and
    near another one, each corresponds to the one with the nearest centroid.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        other_pos: Vertex positions of the other version, (W, 3), model units.
        other_face: Vertices of its faces, (3, F).

    Returns:
        Rows of the faces of the other version, (F,); 0, 1, 2 and so on if the order is the same.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.3]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> corresponding_faces(pos, face, pos, face.flip(1))
        tensor([1, 0])
    """
    same = torch.arange(face.size(1))
    own, others = face.sort(dim=0).values, other_face.sort(dim=0).values
    if torch.equal(own, others):
        return same
    if len(pos) == len(other_pos):
        number = torch.from_numpy(coincident_rows(torch.cat([own, others], dim=1).t().numpy())[0])
        one, two = number[: face.size(1)].sort(stable=True), number[face.size(1) :].sort(stable=True)
        if torch.equal(one.values, two.values):
            return two.indices[one.indices.argsort()]
    centre, other_centre = face_centroids(pos.double(), face), face_centroids(other_pos.double(), other_face)
    from scipy.spatial import KDTree  # takes a while to import

    distance, nearest = (torch.as_tensor(found) for found in KDTree(other_centre.numpy()).query(centre.numpy()))
    apart = (centre - other_centre).norm(dim=1)
    far = (apart > _FAR * mean_edge_length(other_pos.double(), other_face)) & (distance < apart / 2)
    return nearest if float(far.double().mean()) > _FEW else same
