"""Noise models by name, and mixtures of them."""

import torch
from torch import Generator, Tensor

from dnf_pyg.mesh.noise.correlated import CorrelatedNoise, RayNoise, ScanNoise
from dnf_pyg.mesh.noise.model import Noise
from dnf_pyg.mesh.noise.white import GaussianNoise, GaussianNormalNoise, ImpulsiveNoise, UniformNoise

__all__ = ["NOISE_KINDS", "MixedNoise"]

NOISE_KINDS: dict[str, type[Noise]] = {
    "gaussian": GaussianNormalNoise,
    "isotropic": GaussianNoise,
    "uniform": UniformNoise,
    "impulsive": ImpulsiveNoise,
    "correlated": CorrelatedNoise,
    "ray": RayNoise,
    "scan": ScanNoise,
}
"""Noise models by the names that ``dnf-pyg add-noise --kind`` and :class:`MixedNoise` take."""


class MixedNoise(Noise):
    """Draw a kind of noise for each call, so that a network is trained on several.

    Args:
        shares: How often each kind of :data:`NOISE_KINDS` is drawn, in relation to the others.

    Shapes:
        - **pos:** :math:`(V, 3)`, **face:** :math:`(3, F)`, **output:** :math:`(V, 3)`

    Raises:
        ValueError: If a kind is unknown or a share not positive, or ``level`` is negative or not finite.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> MixedNoise({"gaussian": 3, "uniform": 1})(pos, face, 0.3, torch.Generator().manual_seed(0)).shape
        torch.Size([3, 3])
    """

    def __init__(self, shares: dict[str, float]) -> None:
        unknown = sorted(set(shares) - set(NOISE_KINDS))
        if unknown or not shares or min(shares.values()) <= 0:
            raise ValueError(
                f"Expected 'shares' with positive numbers for some of {', '.join(NOISE_KINDS)} (got {shares}). Leave a "
                "kind out instead of giving it 0."
            )
        self.shares = shares
        self._models = [NOISE_KINDS[kind]() for kind in shares]

    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Return the moved vertices."""
        shares = torch.tensor(list(self.shares.values()), dtype=torch.double)
        drawn = int(torch.multinomial(shares, 1, generator=generator))
        return self._models[drawn](pos, face, level, generator)
