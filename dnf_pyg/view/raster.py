"""Flat-shaded pictures of meshes as arrays, drawn without a display."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.rasterize import nearest_face
from dnf_pyg.view.camera import Camera

__all__ = ["render"]

_SAMPLES = 3  # samples per pixel and axis, averaged against jagged edges
_FRONT, _BACK = (0.82, 0.82, 0.82), (0.46, 0.58, 0.82)  # colours of faces seen from outside and from inside
_LIGHTS = ((-0.45, 0.65, 0.6, 0.85), (0.8, -0.1, 0.5, 0.25))  # direction seen from the camera, strength


def render(pos: Tensor, face: Tensor, camera: Camera, size: int, color: Tensor | None = None) -> NDArray[np.float32]:
    """Draw a mesh, lit from the camera's upper left. Faces seen from behind are lit alike, and blue.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        camera: Where the mesh is seen from.
        size: Pixels per side of the picture.
        color: Colour of each face, (F, 3) in [0, 1], the same from both sides. Faces with NaN, and all faces by
            default, are light grey from the front and blue from behind.

    Returns:
        Picture (size, size, 3): red, green and blue in [0, 1], on white.

    Examples:
        >>> pos, face = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), torch.tensor([[0], [1], [2]])
        >>> picture = render(pos, face, Camera.looking_at(pos, (0, 0, 1)), 20)
        >>> picture.shape, bool(0.4 < (picture[..., 0] < 1).mean() < 0.55)
        ((20, 20, 3), True)
    """
    samples = size * _SAMPLES
    seen = camera.project(pos)
    pixel = torch.stack([(seen[:, 0] + 1) * samples / 2, (1 - seen[:, 1]) * samples / 2, seen[:, 2]], dim=-1)
    face_id = nearest_face(pixel.numpy(), np.ascontiguousarray(face.t().numpy()), samples)
    normal = face_normals(pos.double(), face) @ camera.rotation.t()
    behind = normal[:, 2:] < 0
    normal = torch.where(behind, -normal, normal)
    light = torch.full((face.size(1), 1), 0.22, dtype=torch.float64)
    for x, y, z, strength in _LIGHTS:
        direction = torch.nn.functional.normalize(torch.tensor([x, y, z], dtype=torch.float64), dim=0)
        light += strength * (normal @ direction).clamp(min=0).unsqueeze(-1)
    base = torch.where(behind, light.new_tensor(_BACK), light.new_tensor(_FRONT))
    if color is not None:
        base = torch.where(color.isnan(), base, color.double())
    background = base.new_ones(1, 3)  # the last row, which face id -1 points at
    table = torch.cat([(light * base).clamp(max=1), background]).float().numpy()
    return table[face_id].reshape(size, _SAMPLES, size, _SAMPLES, 3).mean(axis=(1, 3))
