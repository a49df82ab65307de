"""Where a mesh is seen from."""

from dataclasses import dataclass
from typing import get_args

import torch
from torch import Tensor
from torch.nn.functional import normalize

from dnf_pyg.mesh.geometry import face_areas, face_centroids, face_normals
from dnf_pyg.options import Direction

__all__ = ["Camera"]

_ONE_SIDED = 1 / 3  # length of the mean normal above which a mesh shows one side, as a depth scan does; closed: 0
_CORNER = (0.6, 0.5, 1.0)  # direction of view between the axes right, up and front of a closed mesh
_AXIS_PREFERENCE = (0.06, 0.03, 0.0)  # added to relative variances, so that spheres and cubes keep the coordinate axes


@dataclass(frozen=True)
class Camera:
    """Orthographic camera. Meshes drawn with one camera can be compared.

    Attributes:
        rotation: Rows are the axes right, up and towards the viewer, (3, 3).
        center: Point in the middle of the picture, (3,).
        radius: Half of the picture's side, model units.
    """

    rotation: Tensor
    center: Tensor
    radius: float

    @classmethod
    def looking_at(cls, pos: Tensor, view: tuple[float, float, float] = _CORNER) -> "Camera":
        """Frame all of ``pos`` (V, 3), seen from the direction ``view``.

        The y axis points up; seen along it, the negative z axis does from above and the positive one from below.

        Examples:
            >>> Camera.looking_at(torch.tensor([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]), (0, 0, 1)).center.tolist()
            [1.0, 1.0, 0.0]
        """
        toward = normalize(torch.tensor(view, dtype=torch.float64), dim=0)
        steep = toward[1].abs() > 0.9
        up = torch.tensor([0.0, 0.0, -toward[1]] if steep else [0.0, 1.0, 0.0], dtype=torch.float64)
        return cls._framing(pos, toward, up)

    @classmethod
    def choose(cls, *meshes: tuple[Tensor, Tensor], view: Direction = "auto") -> "Camera":
        """Frame all meshes from a direction that suits them, or along an axis.

        Meshes that show one side, such as depth scans, are seen along their area-weighted mean normal with the y axis
        pointing up. Others are seen between their principal axes, the thinnest of which points to the viewer.

        Args:
            meshes: Vertex positions (V, 3) and faces (3, F) of each mesh.
            view: auto, or the axis from whose end they are seen: x, -x, y, -y, z, -z.

        Raises:
            ValueError: If ``view`` is another.

        Examples:
            >>> pos, face = torch.tensor([[0.0, 0, 5], [1, 0, 5], [0, 1, 5]]), torch.tensor([[0], [2], [1]])
            >>> Camera.choose((pos, face)).rotation[2].tolist()  # the face looks along the negative z axis
            [0.0, 0.0, -1.0]
        """
        pos = torch.cat([pos for pos, _ in meshes]).double()
        if view not in get_args(Direction):
            known = ", ".join(get_args(Direction))
            raise ValueError(f"Expected 'view' to be one of {known} (got {view!r}). Choose one of these.")
        if view != "auto":
            x, y, z = (float(axis == view[-1]) * (-1 if view[0] == "-" else 1) for axis in "xyz")
            return cls.looking_at(pos, (x, y, z))
        first = torch.tensor([0, *(len(pos) for pos, _ in meshes)]).cumsum(0)
        face = torch.cat([face + start for (_, face), start in zip(meshes, first[:-1], strict=True)], dim=1)
        share = face_areas(pos, face)
        share = (share / share.sum().clamp(min=torch.finfo(share.dtype).tiny)).unsqueeze(-1)
        mean_normal = (share * face_normals(pos, face)).sum(dim=0)
        if mean_normal.norm() > _ONE_SIDED:
            x, y, z = mean_normal.tolist()
            return cls.looking_at(pos, (x, y, z))
        centroid = face_centroids(pos, face)
        centered = centroid - (share * centroid).sum(dim=0)
        covariance = centered.t() @ (share * centered)
        covariance = covariance / covariance.trace().clamp(min=torch.finfo(share.dtype).tiny)
        axes = torch.linalg.eigh(covariance + torch.tensor(_AXIS_PREFERENCE, dtype=torch.float64).diag())[1].t()
        # A hole in the bottom of a mesh leaves a mean normal that points up
        front_hint, up_hint = (mean_normal + 0.05 * mean_normal.new_tensor(axis) for axis in (_CORNER, (0, 1, -0.1)))
        front = axes[0] * torch.sign(axes[0] @ front_hint)
        alignment = axes[1:] @ up_hint
        up = axes[1 + int(alignment.abs().argmax())] * torch.sign(alignment[alignment.abs().argmax()])
        right = torch.linalg.cross(up, front)
        toward = normalize(pos.new_tensor(_CORNER) @ torch.stack([right, up, front]), dim=0)
        return cls._framing(pos, toward, up)

    @classmethod
    def _framing(cls, pos: Tensor, toward: Tensor, up: Tensor) -> "Camera":
        right = normalize(torch.linalg.cross(up, toward), dim=0)
        rotation = torch.stack([right, torch.linalg.cross(toward, right), toward])
        pos = pos.double()
        center = (pos.amin(dim=0) + pos.amax(dim=0)) / 2
        seen = (pos - center) @ rotation.t()
        middle = (seen.amin(dim=0) + seen.amax(dim=0)) / 2
        middle[2] = 0
        radius = float((seen - middle)[:, :2].abs().amax()) * 1.04
        return cls(rotation, center + middle @ rotation, max(radius, torch.finfo(torch.float64).tiny))

    def project(self, pos: Tensor) -> Tensor:
        """Positions (V, 3) seen from the camera, (V, 3): right and up in [-1, 1] where visible, nearer is larger."""
        return (pos.double() - self.center) @ self.rotation.t() / self.radius
