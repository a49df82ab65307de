"""What earlier networks of a cascade make of noisy meshes: the data of the network that follows."""

from dataclasses import replace
from math import inf

import torch
from torch import Tensor

from dnf_pyg.mesh import filled_face_normals
from dnf_pyg.options import FilterOptions, UpdateOptions
from dnf_pyg.pipeline import denoise
from dnf_pyg.weights.load import load_cascade
from dnf_pyg.weights.release import fingerprint

__all__ = ["Refinement"]


class Refinement:
    """Denoise a mesh by trained networks, for the training of the next network of their cascade.

    Args:
        weights: Networks as for :func:`~dnf_pyg.weights.load.load_cascade`; those of a cascade run in order.
        update: How vertices are moved; as the whole cascade will be used.
        precision: Precision of the matrix products: fp32 or bf16.

    Raises:
        WeightsError: If the weights cannot be loaded.
    """

    def __init__(self, weights: str, update: UpdateOptions = UpdateOptions(), precision: str = "fp32") -> None:
        self.cascade = load_cascade(weights)
        self.update = replace(update, max_excess=inf)  # the limit is for the end of the cascade
        self.filtering = FilterOptions(precision=precision)

    def __call__(self, pos: Tensor, face: Tensor) -> tuple[Tensor, Tensor]:
        """Return the denoised positions (V, 3), and of each face the filtered and the noisy normal (F, 2, 3)."""
        result = denoise((pos, face.t()), self.cascade, filtering=self.filtering, update=self.update)
        return result.pos, torch.stack([result.normal.double(), filled_face_normals(pos, face)], dim=1)

    def __repr__(self) -> str:
        return f"Refinement({fingerprint(self.cascade)}, {self.update}, {self.filtering})"
