"""Vertex positions that fit given facet normals."""

import torch
from torch import Tensor

__all__ = ["update_vertices"]


def update_vertices(
    pos: Tensor, face: Tensor, normal: Tensor, num_iterations: int = 20, tolerance: float = 1e-5
) -> Tensor:
    """Move vertices until the faces around them are orthogonal to the given normals.

    Every iteration moves all vertices at once: ``v_i += mean over faces k around i of n_k (n_k . (c_k - v_i))`` with
    the current centroid ``c_k`` of face k. It ends early when no vertex moves by more than ``tolerance``.

    Source: Sun et al., Fast and Effective Feature-Preserving Mesh Denoising, TVCG 2007, Sec. 4.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        normal: Wanted facet normals, (F, 3), unit length; a zero vector leaves its face out.
        num_iterations: Most iterations done.
        tolerance: Largest movement per iteration, in mean edge lengths, below which the update ends.

    Returns:
        Updated positions, (V, 3), of the dtype of ``pos``; vertices without a face stay.

    Raises:
        ValueError: If shapes do not agree or ``num_iterations`` is negative.

    Examples:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.3]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> up = torch.tensor([[0.0, 0, 1], [0, 0, 1]])
        >>> flat = update_vertices(pos, face, up, num_iterations=100)
        >>> bool((flat[:, 2] - flat[:, 2].mean()).abs().max() < 1e-3)
        True
    """
    if normal.shape != (face.size(1), 3):
        raise ValueError(f"Expected 'normal' of shape [{face.size(1)}, 3] (got {list(normal.shape)})")
    if num_iterations < 0:
        raise ValueError(f"Expected 'num_iterations' of at least 0 (got {num_iterations})")
    corner = face.reshape(-1)  # (3 * F,)
    normal = normal.to(pos)
    count = torch.zeros(pos.size(0), dtype=pos.dtype, device=pos.device).index_add_(
        0, corner, torch.ones_like(corner, dtype=pos.dtype)
    )
    share = count.clamp(min=1).reciprocal().unsqueeze(-1)
    edge = pos[face] - pos[face.roll(1, 0)]  # (3, F, 3)
    smallest_step = tolerance * float(edge.norm(dim=-1).mean()) if face.numel() else 0.0
    for _ in range(num_iterations):
        centroid = pos[face].mean(dim=0)  # (F, 3)
        height = (normal * (centroid - pos[face])).sum(dim=-1, keepdim=True)  # (3, F, 1)
        step = torch.zeros_like(pos).index_add_(0, corner, (height * normal).reshape(-1, 3)) * share
        pos = pos + step
        if float(step.norm(dim=-1).max()) <= smallest_step:
            break
    return pos
