"""Virtual depth cameras and scanners: the part of a mesh that they see, without and with their noise."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Generator, Tensor

from dnf_pyg.mesh.geometry import face_normals

__all__ = ["DepthCamera", "KinectFusion", "KinectV1", "KinectV2", "StructuredLight", "View"]


class View(NamedTuple):
    """What a camera sees of a mesh.

    Shapes:
        - **clean:** :math:`(V, 3)`, **noisy:** :math:`(V, 3)`, **face:** :math:`(3, F)`; camera coordinates, metres
    """

    clean: Tensor
    noisy: Tensor
    face: Tensor


class DepthCamera(ABC):
    """View a mesh from one side, with depth errors.

    The mesh is scaled to ``size`` and placed at ``distance`` in front of the camera, which looks along the z axis.
    Hidden and grazing faces are dropped, and the other vertices move along their viewing rays. The errors are sums of
    white noise on the pixels of the image, blurred and interpolated at the vertices. Subclasses implement
    :meth:`depth_error`, and :meth:`quantise` where the camera rounds.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
        focal: Focal length, pixels.
        parts: Standard deviation of the blur, pixels, and share in the variance for each part of the errors. The
            errors of a part with blur 0 are independent at every vertex.

    Raises:
        ValueError: If ``parts`` is empty or holds a negative number.

    Example:
        >>> import trimesh
        >>> sphere = trimesh.creation.icosphere(subdivisions=3)
        >>> pos, face = torch.tensor(sphere.vertices), torch.tensor(sphere.faces).t()
        >>> view = KinectV1()(pos, face, torch.eye(3, dtype=torch.float64), torch.Generator().manual_seed(0))
        >>> view.face.size(1) < face.size(1), view.noisy.shape == view.clean.shape
        (True, True)
    """

    def __init__(self, distance: float, size: float, focal: float, parts: Sequence[tuple[float, float]]) -> None:
        if not parts or min(min(part) for part in parts) < 0:
            raise ValueError(
                f"Expected 'parts' as pairs of numbers of at least 0 (got {parts}). Give the blur in pixels and the "
                "share of the variance."
            )
        self.distance, self.size, self.focal, self.parts = distance, size, focal, parts

    @abstractmethod
    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Compute the standard deviation (P) of the depth, metres, from depth (P), metres, and slant (P), radians."""

    def quantise(self, depth: Tensor) -> Tensor:
        """Round a depth (P), metres, to what the camera can express."""
        return depth

    def __call__(self, pos: Tensor, face: Tensor, rotation: Tensor, generator: Generator | None = None) -> View:
        """View a mesh with vertices (V, 3) in any unit and faces (3, F), turned by a rotation (3, 3)."""
        extent = (pos.amax(0) - pos.amin(0)).max()
        placed = (pos - (pos.amax(0) + pos.amin(0)) / 2) @ rotation.t().to(pos) * (self.size / extent)
        placed = placed + pos.new_tensor([0.0, 0.0, self.distance])
        used, face = face[:, self._visible(placed, face)].unique(return_inverse=True)
        return View(placed[used], self.measure(placed[used], face, generator), face)

    def measure(self, pos: Tensor, face: Tensor, generator: Generator | None = None) -> Tensor:
        """Move the vertices of a surface in view along their rays by the errors of the camera.

        Args:
            pos: Vertices (V, 3) in camera coordinates, metres.
            face: Faces (3, F).
            generator: Source of the noise.

        Returns:
            Measured vertices, (V, 3).
        """
        depth, pixel = pos[:, 2], self.focal * pos[:, :2] / pos[:, 2:]
        scale = sum(share for _, share in self.parts) ** -0.5
        error = torch.zeros_like(depth)
        for blur, share in self.parts:
            error += scale * share**0.5 * _error_image(pixel, blur, generator)
        measured = self.quantise(depth + error * self.depth_error(depth, self._slant(pos, face)))
        return pos * (measured / depth)[:, None]

    def _visible(self, pos: Tensor, face: Tensor) -> Tensor:
        """Mark the faces (F) that the camera sees at less than 80 degrees and that no other face hides."""
        centroid = pos[face].mean(0)
        ray = torch.nn.functional.normalize(centroid, dim=1)
        facing = -(face_normals(pos, face) * ray).sum(1) > math.cos(math.radians(80))
        edge = (pos[face[0]] - pos[face[1]]).norm(dim=1).mean()
        pixels = 2 * self.focal * edge / self.distance  # cells of two edges, in which the nearest face hides the others
        cell = (self.focal * centroid[:, :2] / centroid[:, 2:] / pixels).round().long()
        cell = cell - cell.amin(0)
        place = cell[:, 0] * (cell[:, 1].max() + 1) + cell[:, 1]
        nearest = torch.full((int(place.max()) + 1,), float("inf"), dtype=pos.dtype)
        nearest.scatter_reduce_(0, place, centroid[:, 2], "amin")
        return facing & (centroid[:, 2] < nearest[place] + 6 * edge)  # a slanted surface falls off by less

    def _slant(self, pos: Tensor, face: Tensor) -> Tensor:
        """Compute the angle (V) between the normal and the viewing ray of each vertex."""
        normal = torch.zeros_like(pos).index_add_(0, face.flatten(), face_normals(pos, face).repeat(3, 1))
        cosine = -torch.cosine_similarity(normal, pos).clamp(-1, 0)
        return cosine.arccos()


class KinectV1(DepthCamera):
    """Structured light: the error grows with the square of the depth, and depth comes in steps of disparity.

    Source: Nguyen, Izadi and Lovell 2012, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
    Sec. 2 (axial noise 0.0012 + 0.0019 (z - 0.4)^2 metres at slants of 10 to 60 degrees, and
    0.0001 / sqrt(z) slant^2 / (pi/2 - slant)^2 more beyond); Barron and Malik 2013, "Intrinsic scene properties from a
    single RGB-D image" (depth rounded to 35130 / n centimetres with whole n, as in the public Kinect simulators: a
    baseline of 75 mm, disparity in steps of 1/8 pixel and a focal length of 585.5 pixels, since
    8 * 585.5 * 7.5 = 35130). The driver then rounds to whole millimetres. The blurs follow a measured pair, a pyramid
    of the CNR benchmark at 0.74 metres: its error of 1.9 mm has correlations of 0.62, 0.44, 0.29 and 0.25 at vertices
    one to four edges of 1.8 pixels apart, and turns the facet normals by 26.1 degrees in the mean.
    Differs: Nguyen et al. measured what the sensor delivers, steps included; here its noise comes before the steps,
    which add 0.8 mm of standard deviation to its 1.9 mm at one metre. Their lateral noise of 0.8 pixels is left to the
    blur of the errors. Slants count up to 80 degrees.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
    """

    def __init__(self, distance: float = 1.0, size: float = 0.5) -> None:
        super().__init__(distance, size, focal=585.5, parts=((0.0, 0.04), (1.5, 0.66), (8.3, 0.3)))

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Compute the axial noise of Nguyen et al."""
        grazing = slant.square() / (math.pi / 2 - slant.clamp(max=1.4)).square()
        return 0.0012 + 0.0019 * (depth - 0.4).square() + 0.0001 / depth.sqrt() * grazing * (slant > math.pi / 3)

    def quantise(self, depth: Tensor) -> Tensor:
        """Round to the nearest step of disparity, then to whole millimetres."""
        steps = 8 * self.focal * 0.075
        return (1000 * steps / (steps / depth).round()).round() / 1000


class KinectFusion(KinectV1):
    """Kinect v1 depth images fused in a truncated signed distance field (TSDF), as Kinect Fusion does.

    Fusion averages the views. Errors that change from image to image shrink with the square root of their number, those
    of long range stay, since calibration and pattern are alike in neighbouring views. What is left is smooth, as on
    measured meshes (correlations of about 0.96, 0.92 and 0.88 at vertices one to three edges apart).

    Source: Newcombe et al. 2011, "KinectFusion: Real-time dense surface mapping and tracking" (the fused surface is a
    weighted average of the measured ones).
    Differs: the grid of the field is not modelled.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
        num_views: Number of depth images.

    Raises:
        ValueError: If ``num_views`` is below 1.
    """

    def __init__(self, distance: float = 1.0, size: float = 0.5, num_views: int = 30) -> None:
        if num_views < 1:
            raise ValueError(f"Expected 'num_views' of at least 1 (got {num_views}). Use KinectV1 for a single image.")
        super().__init__(distance, size)
        *changing, lasting = self.parts
        self.parts = (*((blur, share / num_views) for blur, share in changing), lasting)
        self.remainder = sum(share for _, share in self.parts) ** 0.5

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Compute what averaging leaves of the axial noise; no surface is aslant to all views."""
        return self.remainder * super().depth_error(depth, torch.zeros_like(slant))

    def quantise(self, depth: Tensor) -> Tensor:
        """Return the depth: an average has no steps."""
        return depth


class KinectV2(DepthCamera):
    """Time of flight: a finer error that grows little with the depth and much at grazing slants.

    Source: Fankhauser et al. 2015, "Kinect v2 for mobile robot navigation: evaluation and modeling", Sec. IV (axial
    noise 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) slant^2 / (pi/2 - slant)^2 millimetres, z in metres; read in
    implementations of it, not in the paper). The depth of a time-of-flight camera has no visible steps. The focal
    length of its depth image is 365 pixels.
    Differs: the further noise in sunlight and the lateral noise are left out.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
    """

    def __init__(self, distance: float = 1.0, size: float = 0.5) -> None:
        super().__init__(distance, size, focal=365.0, parts=((1.0, 1.0),))

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Compute the axial noise of Fankhauser et al."""
        grazing = slant.square() / (math.pi / 2 - slant.clamp(max=1.4)).square()
        return 1e-3 * (1.5 - 0.5 * depth + 0.3 * depth.square() + 0.1 * depth.pow(1.5) * grazing)


class StructuredLight(DepthCamera):
    """Desktop scanner with structured light or a laser line: small errors of moderate range.

    The blurs follow scans of 3D prints (PrintData), whose errors of 0.15 mm have correlations of about 0.82, 0.64,
    0.48 and 0.33 at vertices one to four edges of 0.34 mm apart.

    Args:
        distance: From the scanner to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
    """

    def __init__(self, distance: float = 0.4, size: float = 0.04) -> None:
        super().__init__(distance, size, focal=2400.0, parts=((0.0, 0.06), (3.0, 0.67), (8.0, 0.27)))

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Compute the axial noise: 0.15 mm at 0.4 metres for a surface that faces the scanner."""
        return 0.00015 * (depth / 0.4).square() / slant.clamp(max=1.4).cos()


def _error_image(pixel: Tensor, blur: float, generator: Generator | None) -> Tensor:
    """Draw errors (V) of unit variance at image points (V, 2), blurred by a standard deviation in pixels."""
    if blur == 0:
        return torch.randn(len(pixel), generator=generator, dtype=pixel.dtype)
    low = pixel.amin(0).floor() - 1
    width, height = ((pixel.amax(0) - low).ceil() + 2).long().tolist()
    reach = max(1, math.ceil(3 * blur))
    image = torch.randn((1, 1, height + 2 * reach, width + 2 * reach), generator=generator, dtype=pixel.dtype)
    kernel = torch.exp(-0.5 * (torch.arange(-reach, reach + 1, dtype=pixel.dtype) / blur).square())
    kernel = kernel / kernel.square().sum().sqrt()  # keeps the variance
    blurred = torch.nn.functional.conv2d(image, kernel.view(1, 1, 1, -1))
    blurred = torch.nn.functional.conv2d(blurred, kernel.view(1, 1, -1, 1))
    place = 2 * (pixel - low) / pixel.new_tensor([width - 1, height - 1]) - 1
    return torch.nn.functional.grid_sample(blurred, place.view(1, 1, -1, 2), align_corners=True).flatten()
