"""Facet normals and the angles between them, areas, centroids, edges and vertex normals of a triangle mesh."""

import torch
from torch import Tensor

__all__ = [
    "angular_difference",
    "edge_lengths",
    "edges",
    "face_areas",
    "face_centroids",
    "face_normals",
    "filled_face_normals",
    "mean_edge_length",
    "vertex_normals",
]

_SLIVER = 1e-12  # sine of the angle between two edges of a face below which it has no normal


def _edge_vectors(pos: Tensor, face: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Two edges (F, 3) of each face in float64, divided by their largest entry, and that entry (F, 1)."""
    corner = pos.double()[face]  # (3, F, 3)
    u, v = corner[1] - corner[0], corner[2] - corner[0]
    size = torch.maximum(u.abs(), v.abs()).amax(dim=-1, keepdim=True)
    scale = torch.where(size > 0, size, torch.ones_like(size))
    return u / scale, v / scale, scale


def face_normals(pos: Tensor, face: Tensor) -> Tensor:
    """Compute the facet normals.

    Computed in float64 from edges that are scaled face by face, so that size and place of the mesh do not matter.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Unit normals, shape (F, 3), dtype of ``pos``; zero for a face without area.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> face_normals(pos, torch.tensor([[0, 0], [1, 1], [2, 0]]))
        tensor([[0., 0., 1.],
                [0., 0., 0.]])
    """
    u, v, _ = _edge_vectors(pos, face)
    cross = torch.linalg.cross(u, v)
    length = torch.linalg.vector_norm(cross, dim=-1, keepdim=True)
    normal = torch.where(length > _SLIVER, cross / length.clamp(min=_SLIVER), torch.zeros_like(cross))
    return normal.to(pos.dtype)


def face_areas(pos: Tensor, face: Tensor) -> Tensor:
    """Compute the face areas.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Areas, shape (F,), squared model units, dtype of ``pos``.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> face_areas(pos, torch.tensor([[0, 1], [1, 3], [2, 2]]))
        tensor([0.5000, 0.5000])
    """
    u, v, scale = _edge_vectors(pos, face)
    area = 0.5 * torch.linalg.vector_norm(torch.linalg.cross(u, v), dim=-1) * scale.squeeze(-1).square()
    return area.to(pos.dtype)


def face_centroids(pos: Tensor, face: Tensor) -> Tensor:
    """Compute the face centroids.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Centroids, shape (F, 3), model units, dtype of ``pos``.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
        >>> face_centroids(pos, torch.tensor([[0], [1], [2]]))
        tensor([[1., 1., 0.]])
    """
    return pos[face].mean(dim=0)


def edges(face: Tensor) -> Tensor:
    """List the undirected edges, each once.

    Args:
        face: Vertices of each face, shape (3, F).

    Returns:
        Edges, shape (2, U), the smaller vertex first, sorted, without edges from a vertex to itself.

    Example:
        >>> edges(torch.tensor([[0, 1], [1, 3], [2, 2]]))
        tensor([[0, 0, 1, 1, 2],
                [1, 2, 2, 3, 3]])
    """
    if face.numel() == 0:
        return face.new_empty(2, 0)
    start, end = face.flatten(), face.roll(-1, dims=0).flatten()
    low, high = torch.minimum(start, end), torch.maximum(start, end)
    base = int(face.max()) + 1
    code = (low * base + high)[low != high].sort().values
    code = code[code.diff(prepend=code.new_full((1,), -1)) > 0]
    return torch.stack([code // base, code % base])


def mean_edge_length(pos: Tensor, face: Tensor) -> Tensor:
    """Compute the mean length of the undirected edges.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Mean length, 0-d, model units, dtype of ``pos``; zero for a mesh without edges.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
        >>> mean_edge_length(pos, torch.tensor([[0], [1], [2]]))
        tensor(4.)
    """
    length = edge_lengths(pos, edges(face))
    return length.mean().to(pos.dtype) if length.numel() else pos.new_zeros(())


def edge_lengths(pos: Tensor, edge: Tensor) -> Tensor:
    """Compute the length of each edge.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        edge: Vertices of each edge, shape (2, U).

    Returns:
        Lengths, shape (U,), model units, float64.

    Example:
        >>> edge_lengths(torch.tensor([[0.0, 0, 0], [3, 4, 0]]), torch.tensor([[0], [1]]))
        tensor([5.], dtype=torch.float64)
    """
    position = pos.double()
    return torch.linalg.vector_norm(position[edge[0]] - position[edge[1]], dim=-1)


def vertex_normals(pos: Tensor, face: Tensor) -> Tensor:
    """Compute vertex normals as the area-weighted sum of the normals of the faces around each vertex.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Unit normals, shape (V, 3), dtype of ``pos``; zero where no face with area touches the vertex, or
        where the sum is zero.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
        >>> vertex_normals(pos, torch.tensor([[0], [1], [2]]))[[0, 3]]
        tensor([[0., 0., 1.],
                [0., 0., 0.]])
    """
    return _unit(_vertex_normal_sums(pos, face)).to(pos.dtype)


def filled_face_normals(pos: Tensor, face: Tensor) -> Tensor:
    """Compute facet normals of unit length for all faces, as a network takes them.

    A face without area gets the area-weighted mean normal of the faces around its three vertices, or ``(0, 0, 1)``
    where that is zero too.

    Args:
        pos: Vertex positions, shape (V, 3), model units.
        face: Vertices of each face, shape (3, F).

    Returns:
        Unit normals, shape (F, 3), dtype of ``pos``.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> filled_face_normals(pos, torch.tensor([[0, 0], [1, 1], [2, 1]]))
        tensor([[0., 0., 1.],
                [0., 0., 1.]])
    """
    normal = face_normals(pos, face)
    missing = (normal == 0).all(dim=-1)
    if missing.any():
        around = _unit(_vertex_normal_sums(pos, face)[face[:, missing]].sum(dim=0))
        around[(around == 0).all(dim=-1)] = around.new_tensor([0.0, 0.0, 1.0])
        normal[missing] = around.to(pos.dtype)
    return normal


def angular_difference(normal: Tensor, clean_normal: Tensor) -> Tensor:
    """Compute the angles between corresponding normals, exact for small angles too (no arc cosine).

    Args:
        normal: Normals, shape (F, 3), of any length; a zero vector, a collapsed face, counts as 90 degrees off.
        clean_normal: Normals to compare with, shape (F, 3).

    Returns:
        Angles, shape (F,) float32, degrees from 0 to 180.

    Example:
        >>> angular_difference(torch.tensor([[1.0, 0.0, 0.0]]), torch.tensor([[1.0, 1.0, 0.0]]))
        tensor([45.])
    """
    normal, clean_normal = normal.double(), clean_normal.double()
    sine = torch.linalg.cross(normal, clean_normal).norm(dim=-1)
    cosine = (normal * clean_normal).sum(dim=-1)
    angle = torch.rad2deg(torch.atan2(sine, cosine))
    return torch.where((sine == 0) & (cosine == 0), 90.0, angle).float()


def _vertex_normal_sums(pos: Tensor, face: Tensor) -> Tensor:
    """Sum the area vectors of the faces around each vertex, (V, 3) float64 in units of the largest face."""
    u, v, scale = _edge_vectors(pos, face)
    relative = scale / scale.amax() if scale.numel() else scale
    area_vector = torch.linalg.cross(u, v) * relative.square()
    total = area_vector.new_zeros(pos.size(0), 3)
    for corner in face:
        total.index_add_(0, corner, area_vector)
    return total


def _unit(vector: Tensor) -> Tensor:
    """Scale rows to unit length; rows of zeros stay."""
    size = vector.abs().amax(dim=-1, keepdim=True)
    vector = vector / torch.where(size > 0, size, torch.ones_like(size))
    length = torch.linalg.vector_norm(vector, dim=-1, keepdim=True)
    return vector / torch.where(length > 0, length, torch.ones_like(length))
