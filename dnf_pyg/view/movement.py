"""How far vertices have moved outwards or inwards, and scales for such values."""

import numpy as np
import torch
from torch import Tensor

from dnf_pyg.mesh.geometry import mean_edge_length, vertex_normals

__all__ = ["scale_end", "signed_movement"]


def signed_movement(before: Tensor, after: Tensor, face: Tensor) -> Tensor:
    """Displacement of each vertex along the outward normal of the moved surface.

    Args:
        before: Vertex positions before, (V, 3).
        after: Vertex positions after, (V, 3).
        face: Vertices of each face, (3, F).

    Returns:
        Displacement (V,) in mean edge lengths of the mesh before; positive where a vertex has moved outwards.

    Example:
        >>> before = torch.tensor([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]])
        >>> after = before + torch.tensor([0.0, 0, -1])
        >>> signed_movement(before, after, torch.tensor([[0], [1], [2]])).round(decimals=2).tolist()
        [-0.44, -0.44, -0.44]
    """
    before, after = before.double(), after.double()
    along = ((after - before) * vertex_normals(after, face)).sum(dim=-1)
    return along / mean_edge_length(before, face).clamp(min=torch.finfo(torch.float64).tiny)


def scale_end(values: Tensor) -> float:
    """Upper end of a scale that 99% of the magnitudes lie below: 1, 2, 4 or 8 times a power of ten; 1 if all are zero.

    Example:
        >>> scale_end(torch.tensor([-0.03, 0.01])), scale_end(torch.zeros(2))
        (0.04, 1.0)
    """
    end = float(np.quantile(values.abs().numpy(), 0.99)) if len(values) else 0.0
    if end <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(end))
    return float(next(step for step in (1, 2, 4, 8, 10) if step * power >= end) * power)
