"""Noise models that move every vertex independently of the others."""

import torch
from torch import Generator, Tensor

from dnf_pyg.mesh.geometry import vertex_normals
from dnf_pyg.mesh.noise.model import Noise, noise_scale

__all__ = ["GaussianNoise", "GaussianNormalNoise", "ImpulsiveNoise", "UniformNoise"]


class GaussianNormalNoise(Noise):
    r"""Move each vertex along its normal by a Gaussian amount, the noise of the CNR benchmark.

    .. math::
        \mathbf{v}'_i = \mathbf{v}_i + \epsilon_i \mathbf{n}_i, \quad
        \epsilon_i \sim \mathcal{N}(0, (\lambda \bar{l}_e)^2)

    with the area-weighted unit vertex normal and the mean edge length :math:`\bar{l}_e`.
    Source: Wang et al. 2016, Sec. 5 (measured on its files: displacement along the vertex normal only).

    Shapes:
        - **pos:** :math:`(V, 3)`, model units
        - **face:** :math:`(3, F)`
        - **level:** standard deviation :math:`\lambda`, multiples of the mean edge length
        - **output:** :math:`(V, 3)`; a vertex without a normal (no face, zero-area faces) stays

    Raises:
        ValueError: If ``level`` is negative or not finite.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        >>> face = torch.tensor([[0, 0], [1, 2], [2, 3]])
        >>> moved = GaussianNormalNoise()(pos, face, 0.1, torch.Generator().manual_seed(0))
        >>> bool((moved[:, :2] == pos[:, :2]).all()), bool((moved[:, 2] != 0).all())
        (True, True)
    """

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        amount = torch.empty_like(pos[:, :1]).normal_(generator=generator)
        return pos + noise_scale(pos, face, level) * amount * vertex_normals(pos, face)


class GaussianNoise(Noise):
    """Move each vertex by an isotropic Gaussian vector.

    Each coordinate has standard deviation ``level`` mean edge lengths, so the vector is longer than the one of
    :class:`GaussianNormalNoise` by sqrt(3) and moves vertices along the surface too.

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`, **output:** :math:`(V, 3)`

    Raises:
        ValueError: If ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> torch.equal(GaussianNoise()(pos, face, 0.0), pos)
        True
    """

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        return pos + noise_scale(pos, face, level) * torch.empty_like(pos).normal_(generator=generator)


class UniformNoise(Noise):
    """Move each vertex along its normal by an amount uniform in plus or minus ``level`` mean edge lengths.

    Its standard deviation is ``level / sqrt(3)`` mean edge lengths.
    Source: DNF-Net (Li et al. 2020), Sec. 4.4, "Robustness on noise patterns".

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`, **output:** :math:`(V, 3)`

    Raises:
        ValueError: If ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> moved = UniformNoise()(pos, face, 0.5, torch.Generator().manual_seed(0))
        >>> bool(((moved - pos).norm(dim=1) <= 0.5 * 2**0.5).all())
        True
    """

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        amount = torch.empty_like(pos[:, :1]).uniform_(-1.0, 1.0, generator=generator)
        return pos + noise_scale(pos, face, level) * amount * vertex_normals(pos, face)


class ImpulsiveNoise(Noise):
    """Move a random share of the vertices along their normals by Gaussian amounts; the others stay exact.

    Source: DNF-Net (Li et al. 2020), Sec. 4.4, "Robustness on noise patterns"; the share is not stated there.

    Args:
        share: Probability that a vertex moves, in (0, 1].

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`, **output:** :math:`(V, 3)`

    Raises:
        ValueError: If ``share`` is outside (0, 1], or ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> ImpulsiveNoise(share=0.5)(pos, face, 0.3, torch.Generator().manual_seed(0)).shape
        torch.Size([3, 3])
    """

    def __init__(self, share: float = 0.3) -> None:
        if not 0 < share <= 1:
            raise ValueError(f"Expected 'share' in (0, 1] (got {share}). It is the probability that a vertex moves.")
        self.share = share

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        hit = torch.empty_like(pos[:, :1]).uniform_(generator=generator) < self.share
        amount = torch.empty_like(pos[:, :1]).normal_(generator=generator) * hit
        return pos + noise_scale(pos, face, level) * amount * vertex_normals(pos, face)
