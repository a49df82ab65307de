"""A virtual depth camera: the part of a mesh that it sees, and the same part with the camera's noise."""

import math
from typing import NamedTuple

import torch
from torch import Generator, Tensor

from dnf_pyg.mesh.geometry import face_normals

__all__ = ["DepthCamera", "KinectV1", "KinectV2", "View"]


class View(NamedTuple):
    """What a camera sees of a mesh.

    Shapes:
        - **clean:** :math:`(V, 3)`, **noisy:** :math:`(V, 3)`, **face:** :math:`(3, F)`; camera coordinates, metres
    """

    clean: Tensor
    noisy: Tensor
    face: Tensor


class DepthCamera:
    """Look at a mesh from one side: hidden and grazing faces are dropped, vertices err along their viewing rays.

    The mesh is scaled to ``size`` and put at ``distance`` before the camera, which looks along z. Depth errors are
    drawn on the pixels of the image, blurred over neighbouring ones as block matching does, and interpolated at the
    vertices. A subclass says how large they are.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
        focal: Focal length, pixels.
        blur: Standard deviation of the blur of the errors, pixels.

    Example:
        >>> import trimesh
        >>> sphere = trimesh.creation.icosphere(subdivisions=3)
        >>> pos, face = torch.tensor(sphere.vertices), torch.tensor(sphere.faces).t()
        >>> view = KinectV1()(pos, face, torch.eye(3, dtype=torch.float64), torch.Generator().manual_seed(0))
        >>> view.face.size(1) < face.size(1), view.noisy.shape == view.clean.shape
        (True, True)
    """

    def __init__(self, distance: float, size: float, focal: float, blur: float) -> None:
        self.distance, self.size, self.focal, self.blur = distance, size, focal, blur

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Standard deviation (P) of the depth, metres, at a depth (P), metres, and a slant (P), radians."""
        raise NotImplementedError

    def quantise(self, depth: Tensor) -> Tensor:
        """Depth (P) as the camera can tell it, metres."""
        return depth

    def __call__(self, pos: Tensor, face: Tensor, rotation: Tensor, generator: Generator | None = None) -> View:
        """Take a picture.

        Args:
            pos: Vertices (V, 3), any unit.
            face: Faces (3, F).
            rotation: Turns the mesh (3, 3) before it is looked at.
            generator: Source of the noise.
        """
        extent = (pos.amax(0) - pos.amin(0)).max()
        placed = (pos - (pos.amax(0) + pos.amin(0)) / 2) @ rotation.t().to(pos) * (self.size / extent)
        placed = placed + pos.new_tensor([0.0, 0.0, self.distance])
        used, face = face[:, self._visible(placed, face)].unique(return_inverse=True)
        clean = placed[used]
        depth, pixel = clean[:, 2], self.focal * clean[:, :2] / clean[:, 2:]
        slant = self._slant(clean, face)
        error = self._error_image(pixel, generator) * self.depth_error(depth, slant)
        noisy = clean * (self.quantise(depth + error) / depth)[:, None]
        return View(clean, noisy, face)

    def _visible(self, pos: Tensor, face: Tensor) -> Tensor:
        """Faces (F) that look at the camera at less than 80 degrees and are not behind others."""
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
        """Angle (V) between each vertex's normal and its viewing ray."""
        normal = torch.zeros_like(pos).index_add_(0, face.flatten(), face_normals(pos, face).repeat(3, 1))
        cosine = -torch.cosine_similarity(normal, pos).clamp(-1, 0)
        return cosine.arccos()

    def _error_image(self, pixel: Tensor, generator: Generator | None) -> Tensor:
        """Blurred white noise of unit variance, interpolated at image points (V, 2)."""
        low = pixel.amin(0).floor() - 1
        width, height = ((pixel.amax(0) - low).ceil() + 2).long().tolist()
        reach = max(1, math.ceil(3 * self.blur))
        size = (1, 1, height + 2 * reach, width + 2 * reach)
        image = torch.randn(size, generator=generator, dtype=pixel.dtype)
        kernel = torch.exp(-0.5 * (torch.arange(-reach, reach + 1, dtype=pixel.dtype) / self.blur).square())
        kernel = kernel / kernel.square().sum().sqrt()  # keeps the variance
        blurred = torch.nn.functional.conv2d(image, kernel.view(1, 1, 1, -1))
        blurred = torch.nn.functional.conv2d(blurred, kernel.view(1, 1, -1, 1))
        place = 2 * (pixel - low) / pixel.new_tensor([width - 1, height - 1]) - 1
        return torch.nn.functional.grid_sample(blurred, place.view(1, 1, -1, 2), align_corners=True).flatten()


class KinectV1(DepthCamera):
    """Structured light: the error grows with the square of the depth, and depth comes in steps of disparity.

    Source: Nguyen, Izadi and Lovell 2012, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
    Sec. 2 (axial noise 0.0012 + 0.0019 (z - 0.4)^2 metres at slants of 10 to 60 degrees, and
    0.0001 / sqrt(z) slant^2 / (pi/2 - slant)^2 more beyond); Barron and Malik 2013, "Intrinsic scene properties from a
    single RGB-D image" (depth rounded to 35130 / n centimetres with whole n, as in the public Kinect simulators: a
    baseline of 75 mm, disparity in steps of 1/8 pixel and a focal length of 585.5 pixels, since
    8 * 585.5 * 7.5 = 35130).
    Differs: Nguyen et al. measured what the sensor delivers, steps included; here its noise comes before the steps,
    which add 0.8 mm of standard deviation to its 1.9 mm at one metre. Their lateral noise of 0.8 pixels is left to the
    blur of the errors. Slants of 80 degrees and more count as 80: the camera sees no such faces.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
    """

    def __init__(self, distance: float = 1.0, size: float = 0.5) -> None:
        super().__init__(distance, size, focal=585.5, blur=2.0)

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Axial noise of Nguyen et al."""
        grazing = slant.square() / (math.pi / 2 - slant.clamp(max=1.4)).square()
        return 0.0012 + 0.0019 * (depth - 0.4).square() + 0.0001 / depth.sqrt() * grazing * (slant > math.pi / 3)

    def quantise(self, depth: Tensor) -> Tensor:
        """Depth of the nearest step of disparity."""
        steps = 8 * self.focal * 0.075
        return steps / (steps / depth).round()


class KinectV2(DepthCamera):
    """Time of flight: a finer error that grows little with the depth and much at grazing slants.

    Source: Fankhauser et al. 2015, "Kinect v2 for mobile robot navigation: evaluation and modeling", Sec. IV (axial
    noise 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) slant^2 / (pi/2 - slant)^2 millimetres, z in metres; read in
    implementations of it, not in the paper). The depth of a time-of-flight camera comes in no visible steps. Focal
    length of its depth image: 365 pixels.
    Differs: the further noise in sunlight and the lateral noise are left out.

    Args:
        distance: From the camera to the middle of the mesh, metres.
        size: Largest extent of the mesh, metres.
    """

    def __init__(self, distance: float = 1.0, size: float = 0.5) -> None:
        super().__init__(distance, size, focal=365.0, blur=1.0)

    def depth_error(self, depth: Tensor, slant: Tensor) -> Tensor:
        """Axial noise of Fankhauser et al."""
        grazing = slant.square() / (math.pi / 2 - slant.clamp(max=1.4)).square()
        return 1e-3 * (1.5 - 0.5 * depth + 0.3 * depth.square() + 0.1 * depth.pow(1.5) * grazing)
