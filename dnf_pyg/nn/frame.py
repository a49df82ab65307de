"""Frames that rotate with a patch."""

import torch
from torch import Tensor
from torch_geometric.index import index2ptr

from dnf_pyg.nn.kernels.segment import segment_sum

__all__ = ["in_frame", "out_of_frame", "patch_frames"]


@torch.no_grad()
def patch_frames(normal: Tensor, batch: Tensor | None = None, batch_size: int | None = None) -> Tensor:
    r"""Compute axes for each patch in which the coordinates of its normals do not change when the patch is rotated.

    The axes are the eigenvectors of :math:`\sum_i \mathbf{n}_i \mathbf{n}_i^\top`; each points to the side on which
    :math:`\sum_i (\mathbf{n}_i \cdot \mathbf{e})^3` is positive, so a mirrored patch has mirrored axes. Axes of equal
    eigenvalue (a flat or spherical patch without noise) are arbitrary.

    Args:
        normal: Facet normals, shape (F, 3).
        batch: Patch of each face, sorted, shape (F,); one patch if ``None``.
        batch_size: Number of patches P; computed if not given.

    Returns:
        Orthonormal axes in the columns, shape (P, 3, 3); no gradient flows through them.

    Example:
        >>> frame = patch_frames(torch.nn.functional.normalize(torch.randn(9, 3), dim=1))[0]
        >>> torch.allclose(frame.t() @ frame, torch.eye(3), atol=1e-5)
        True
    """
    if batch is None:
        batch, batch_size = normal.new_zeros(normal.size(0), dtype=torch.long), 1
    ptr = index2ptr(batch, int(batch[-1]) + 1 if batch_size is None else batch_size)
    outer = (normal.unsqueeze(2) * normal.unsqueeze(1)).flatten(1)  # (F, 9)
    axes = torch.linalg.eigh(segment_sum(outer, ptr).view(-1, 3, 3)).eigenvectors
    cube = in_frame(normal, axes[batch]) ** 3
    return axes * torch.where(segment_sum(cube, ptr) < 0, -1.0, 1.0).to(axes.dtype).unsqueeze(1)


def in_frame(vector: Tensor, frame: Tensor) -> Tensor:
    """Transform vectors to the coordinates of a frame.

    Args:
        vector: Vectors, shape (F, 3).
        frame: Axes in the columns, for each vector or for all, shape (F, 3, 3) or (1, 3, 3).

    Example:
        >>> in_frame(torch.tensor([[1.0, 2.0, 3.0]]), torch.eye(3).flip(1).unsqueeze(0))
        tensor([[3., 2., 1.]])
    """
    return (vector.unsqueeze(2) * frame).sum(dim=1)


def out_of_frame(vector: Tensor, frame: Tensor) -> Tensor:
    """Transform vectors back from the coordinates of a frame; the inverse of :func:`in_frame`.

    Example:
        >>> out_of_frame(torch.tensor([[3.0, 2.0, 1.0]]), torch.eye(3).flip(1).unsqueeze(0))
        tensor([[1., 2., 3.]])
    """
    return (frame * vector.unsqueeze(1)).sum(dim=2)
