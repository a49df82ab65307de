"""Meshes of one depth image: what a scanner that looks along an axis makes of a shape."""

import torch
from torch import Tensor

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh.rasterize import nearest_face

__all__ = ["depth_image_mesh"]


def depth_image_mesh(
    pos: Tensor,
    face: Tensor,
    num_pixels: int,
    rotation: Tensor | None = None,
    max_jump: float = 4.0,
    falling: bool = False,
) -> tuple[Tensor, Tensor]:
    """Look at a mesh along the z axis and connect neighbouring pixels of its depth image.

    Scans of a single depth image have such meshes: vertices on a grid, stretched along slanted surfaces, open at
    silhouettes. The view is orthographic; over the few pixels that a patch spans, viewing rays are nearly parallel.

    Args:
        pos: Vertex positions, shape (V, 3), any unit.
        face: Vertices of each face, shape (3, F).
        num_pixels: Pixels along the longer side of the image.
        rotation: Rotation that is applied to the mesh before, shape (3, 3).
        max_jump: Largest difference of depth within a face, in pixels; faces with a larger one are left out.
        falling: Split each square of four pixels along the other diagonal.

    Returns:
        Vertex positions (W, 3) float64, in pixels, the depth last and growing away from the viewer, and the vertices
        of each face (3, M), which are seen counter-clockwise.

    Raises:
        MeshError: If the image shows no face.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [2, 0, 1], [0, 2, 0], [2, 2, 1]])
        >>> seen, triangles = depth_image_mesh(pos, torch.tensor([[0, 1], [2, 2], [1, 3]]), num_pixels=3)
        >>> len(seen), triangles.size(1), seen[:, 2].unique().tolist()
        (9, 8, [0.25, 0.75, 1.25])
    """
    pos = pos.double() if rotation is None else pos.double() @ rotation.double().t()
    low = pos.amin(dim=0)
    scale = num_pixels / (pos.amax(dim=0) - low)[:2].max()
    pixel = (pos - low) * scale  # column, row, depth
    mirrored = (pixel * pixel.new_tensor([1.0, 1.0, -1.0])).numpy()  # the nearest face has the least depth
    face_id = torch.from_numpy(nearest_face(mirrored, face.t().contiguous().numpy(), num_pixels)).long()
    row, column = (face_id >= 0).nonzero(as_tuple=True)
    centre = torch.stack([column, row], dim=1) + 0.5
    depth = _depth(pixel[face[:, face_id[row, column]]], centre)
    vertex_id = torch.full((num_pixels, num_pixels), -1)
    vertex_id[row, column] = torch.arange(len(row))
    a, b, c, d = vertex_id[:-1, :-1], vertex_id[:-1, 1:], vertex_id[1:, :-1], vertex_id[1:, 1:]
    halves = ((a, c, b), (b, c, d)) if falling else ((a, d, b), (a, c, d))
    triangles = torch.cat([torch.stack([corner.flatten() for corner in half]) for half in halves], dim=1)
    triangles = triangles[:, (triangles >= 0).all(dim=0)]
    corner_depth = depth[triangles]
    triangles = triangles[:, corner_depth.amax(dim=0) - corner_depth.amin(dim=0) <= max_jump]
    if not triangles.numel():
        raise MeshError(
            f"Expected a mesh that covers pixels of the image (got none of {num_pixels} x {num_pixels}). Raise "
            "'num_pixels' or 'max_jump'."
        )
    used, triangles = triangles.unique(return_inverse=True)
    return torch.cat([centre[used], depth[used].unsqueeze(1)], dim=1), triangles


def _depth(corner: Tensor, point: Tensor) -> Tensor:
    """Depth (P,) of the planes through corners (3, P, 3) at image points (P, 2)."""
    a, normal = corner[0], torch.linalg.cross(corner[1] - corner[0], corner[2] - corner[0])
    return a[:, 2] - ((point - a[:, :2]) * normal[:, :2]).sum(dim=1) / normal[:, 2]
