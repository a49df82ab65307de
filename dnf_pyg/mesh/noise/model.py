"""The interface of noise models, and the scale of their levels."""

from abc import ABC, abstractmethod

from torch import Generator, Tensor

from dnf_pyg.mesh.geometry import mean_edge_length

__all__ = ["Noise", "noise_scale"]


class Noise(ABC):
    """Move the vertices of a mesh at random and leave the tensors passed in unchanged."""

    @abstractmethod
    def __call__(self, pos: Tensor, face: Tensor, level: float, generator: Generator | None = None) -> Tensor:
        """Move the vertices (V, 3) of a mesh by noise of ``level`` mean edge lengths."""


def noise_scale(pos: Tensor, face: Tensor, level: float) -> Tensor:
    """Convert a noise level from mean edge lengths to model units.

    Args:
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        level: Noise level, multiples of the mean edge length.

    Raises:
        ValueError: If ``level`` is negative or not finite.

    Example:
        >>> import torch
        >>> noise_scale(torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), torch.tensor([[0], [1], [2]]), 0.5)
        tensor(2.)
    """
    if not 0 <= level < float("inf"):
        raise ValueError(
            f"Expected 'level' as a finite number of at least 0 (got {level}). Give it in mean edge lengths, for "
            "instance 0.2."
        )
    return level * mean_edge_length(pos, face)
