"""Noise whose displacements are alike at neighbouring vertices, as in real scans."""

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Generator, Tensor

from dnf_pyg.mesh.geometry import edges, vertex_normals
from dnf_pyg.mesh.noise.model import Noise, noise_scale
from dnf_pyg.mesh.vertex_graph import lazy_walk, walk_means

__all__ = ["CorrelatedNoise", "RayNoise", "ScanNoise", "correlated_field"]


def correlated_field(
    face: Tensor, num_vertices: int, lengths: Sequence[float], shares: Sequence[float], generator: Generator | None
) -> Tensor:
    r"""Draw a random field on the vertices as a sum of fields of several correlation lengths.

    Each part is white noise after k steps of :func:`~dnf_pyg.mesh.vertex_graph.lazy_walk`. On an even mesh, the
    correlation of such a part at a distance of r edges is

    .. math::
        \rho(r) \approx \exp(-r^2 / k),

    so a correlation length L, where it has fallen to 1/e, takes :math:`k = L^2` steps (rounded to a whole number).
    Every part is scaled to unit root mean square over the vertices that have a face.

    Args:
        face: Vertices of each face, (3, F).
        num_vertices: Number of vertices V.
        lengths: Correlation length of each part, edges; 0 for white noise.
        shares: Share of each part in the variance, in relation to the others.
        generator: Source of the noise.

    Returns:
        Field (V,) float64 of unit root mean square; 0 at vertices without a face.
    """
    walk = lazy_walk(edges(face), num_vertices)
    used = np.zeros(num_vertices, dtype=bool)
    used[face.cpu().numpy()] = True
    total = np.zeros(num_vertices)
    for length, share in zip(lengths, shares, strict=True):
        part = torch.randn(num_vertices, generator=generator, dtype=torch.double).numpy()
        total += math.sqrt(share) * _unit_rms(walk_means(walk, part, round(length**2)) * used)
    return torch.from_numpy(_unit_rms(total))


class CorrelatedNoise(Noise):
    """Move each vertex along its normal by a field of given correlation lengths.

    The defaults approximate the errors of a Kinect v1, whose correlation is about 0.64, 0.44, 0.28 and 0.24 at one to
    four edges.

    Args:
        lengths: Correlation length of each part of the field, edges; 0 for white noise.
        shares: Share of each part in the variance, in relation to the others.

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`
        - **level:** root mean square of the displacements, multiples of the mean edge length
        - **output:** :math:`(V, 3)`; a vertex without a normal stays

    Raises:
        ValueError: If there are no lengths, as many shares are not given, or one of them is negative or not finite;
            if ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> CorrelatedNoise([0, 2], [0.2, 0.8])(pos, face, 0.3, torch.Generator().manual_seed(0)).shape
        torch.Size([3, 3])
    """

    def __init__(
        self, lengths: Sequence[float] = (0.0, 1.8, 8.0), shares: Sequence[float] = (0.25, 0.47, 0.28)
    ) -> None:
        if not lengths or not all(0 <= length < math.inf for length in lengths):
            raise ValueError(f"Expected 'lengths' of at least 0 edges (got {lengths}). Use 0 for white noise.")
        if len(shares) != len(lengths) or not all(0 <= share < math.inf for share in shares) or sum(shares) == 0:
            raise ValueError(
                f"Expected 'shares' with a number of at least 0 for each of {len(lengths)} lengths (got {shares}). "
                "They are shares of the variance."
            )
        self.lengths, self.shares = lengths, shares

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        scale = noise_scale(pos, face, level)
        field = correlated_field(face, pos.size(0), self.lengths, self.shares, generator)
        return pos + scale * field.to(pos)[:, None] * vertex_normals(pos, face)


class RayNoise(CorrelatedNoise):
    """Move each vertex along its viewing ray, as a depth camera does, by a field of given correlation lengths.

    Args:
        lengths: Correlation length of each part of the field, edges; 0 for white noise.
        shares: Share of each part in the variance, in relation to the others.
        camera: Position (x, y, z) of the camera in model units. Without it, each call draws a direction, and all
            vertices move along it: at random for a closed mesh, from the side that a piece of surface faces.
        step: Round the distance to the camera to whole multiples of this many mean edge lengths; 0 for no rounding.

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`
        - **level:** root mean square of the displacements before rounding, multiples of the mean edge length
        - **output:** :math:`(V, 3)`; a vertex without a face stays

    Raises:
        ValueError: As :class:`CorrelatedNoise`, or if ``step`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> noise = RayNoise([2], [1], camera=(0.0, 0.0, 0.0))
        >>> bool((noise(pos, face, 0.1)[~torch.eye(3, dtype=torch.bool)] == 0).all())
        True
    """

    def __init__(
        self,
        lengths: Sequence[float] = (0.0, 1.8, 8.0),
        shares: Sequence[float] = (0.25, 0.47, 0.28),
        camera: tuple[float, float, float] | None = None,
        step: float = 0.0,
    ) -> None:
        super().__init__(lengths, shares)
        if not 0 <= step < math.inf:
            raise ValueError(f"Expected 'step' of at least 0 mean edge lengths (got {step}). Use 0 for no rounding.")
        self.camera, self.step = camera, step

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        scale = noise_scale(pos, face, level)
        field = correlated_field(face, pos.size(0), self.lengths, self.shares, generator).to(pos)
        if self.camera is None:
            ray = _viewing_direction(pos, face, generator).expand_as(pos)
            distance = (pos * ray).sum(1)
        else:
            offset = pos - pos.new_tensor(self.camera)
            distance = offset.norm(dim=1)
            ray = offset / distance.clamp(min=torch.finfo(pos.dtype).tiny)[:, None]
        amount = scale * field
        if self.step:
            amount = _round_depth(distance, amount, noise_scale(pos, face, self.step))
        return pos + amount[:, None] * ray


class ScanNoise(Noise):
    """Draw correlated noise of the kinds that real scans show, other lengths and directions for each call.

    The field is the sum of white noise, a short part and a long one. A level is as hard to remove as white noise of
    that level: the displacements are scaled until the differences across the edges have the root mean square of those
    of :class:`GaussianNormalNoise`. Correlated displacements are therefore larger than ``level``, by up to
    ``max_gain``. The ranges cover the errors measured on pairs of scans: Kinect v1, fused depth images, and
    structured light.

    Args:
        white: Smallest and largest share of white noise in the variance.
        short: Smallest and largest correlation length of the short part, edges.
        long: Smallest and largest correlation length of the long part, edges.
        ray_share: Probability that vertices move along a viewing ray instead of their normals; half of these
            displacements are rounded to steps of up to 0.6 times their root mean square.
        max_gain: Largest ratio of the root mean square of the displacements to that of white noise.

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`, **output:** :math:`(V, 3)`
        - **level:** standard deviation of white noise of the same roughness, multiples of the mean edge length

    Raises:
        ValueError: If a range is not positive and rising, ``ray_share`` is outside [0, 1] or ``max_gain`` below 1; if
            ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> ScanNoise()(pos, face, 0.3, torch.Generator().manual_seed(0)).shape
        torch.Size([3, 3])
    """

    def __init__(
        self,
        white: tuple[float, float] = (0.005, 0.3),
        short: tuple[float, float] = (1.0, 4.0),
        long: tuple[float, float] = (4.0, 16.0),
        ray_share: float = 0.5,
        max_gain: float = 3.0,
    ) -> None:
        for name, (low, high) in {"white": white, "short": short, "long": long}.items():
            if not 0 < low <= high < math.inf:
                raise ValueError(
                    f"Expected '{name}' as two positive numbers, the smaller one first (got {(low, high)}). A value "
                    "between them is drawn for each call."
                )
        if white[1] > 1 or not 0 <= ray_share <= 1:
            raise ValueError(f"Expected 'white' and 'ray_share' of at most 1 (got {white} and {ray_share}).")
        if not 1 <= max_gain < math.inf:
            raise ValueError(f"Expected 'max_gain' of at least 1 (got {max_gain}). Use 1 for the size of white noise.")
        self.white, self.short, self.long = white, short, long
        self.ray_share, self.max_gain = ray_share, max_gain

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        scale = noise_scale(pos, face, level)
        draw = torch.rand(7, generator=generator, dtype=torch.double).tolist()
        white, short, long = (
            low * (high / low) ** chance
            for (low, high), chance in zip((self.white, self.short, self.long), draw[:3], strict=True)
        )
        shares = (white, (1 - white) * draw[3], (1 - white) * (1 - draw[3]))
        field = correlated_field(face, pos.size(0), (0.0, short, long), shares, generator).to(pos)
        amount = scale * field * self._gain(field, face)
        if draw[4] >= self.ray_share:
            return pos + amount[:, None] * vertex_normals(pos, face)
        ray = _viewing_direction(pos, face, generator)
        if draw[5] < 0.5:
            step = 0.6 * draw[6] * amount.square().mean().sqrt()
            amount = _round_depth(pos @ ray, amount, step)
        return pos + amount[:, None] * ray

    def _gain(self, field: Tensor, face: Tensor) -> float:
        """Ratio of the differences across edges in white noise to those of a field of unit root mean square."""
        start, end = edges(face)
        difference = float((field[start] - field[end]).square().mean()) / 2 if start.numel() else 1.0
        return min(1 / math.sqrt(max(difference, 1e-12)), self.max_gain)


def _viewing_direction(pos: Tensor, face: Tensor, generator: Generator | None) -> Tensor:
    """Unit vector (3), drawn with the cosine of its angle to a flat surface, at random for a closed mesh."""
    drawn = torch.nn.functional.normalize(torch.randn(3, generator=generator, dtype=torch.double), dim=0)
    mean = vertex_normals(pos, face).double().mean(dim=0)
    return torch.nn.functional.normalize(mean + drawn.to(mean.device), dim=0).to(pos)


def _round_depth(depth: Tensor, amount: Tensor, step: Tensor) -> Tensor:
    """Displacements (V) that put depths on whole multiples of a step; vertices that do not move stay."""
    rounded = ((depth + amount) / step).round() * step - depth
    return torch.where((amount == 0) | (step == 0), amount, rounded)


def _unit_rms(field: np.ndarray) -> np.ndarray:
    """Scale to unit root mean square over the values that are not 0."""
    count = np.count_nonzero(field)
    return field / math.sqrt(field @ field / count) if count else field
