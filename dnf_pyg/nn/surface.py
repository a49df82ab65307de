"""Places and sizes of the faces of a patch, in units of the patch."""

import torch
from torch import Tensor
from torch_geometric.index import index2ptr

from dnf_pyg.nn.frame import in_frame
from dnf_pyg.nn.kernels.segment import segment_sum

__all__ = ["patch_surface"]

_SMALLEST = 1e-4  # relative area below which all faces count alike


@torch.no_grad()
def patch_surface(surface: Tensor, batch: Tensor | None = None, frame: Tensor | None = None) -> tuple[Tensor, Tensor]:
    """Free centroids and areas from the size of the mesh, and turn them into the frame of the patch.

    Args:
        surface: Centroid and area of each face, shape (F, 4), model units and their square.
        batch: Patch of each face, sorted, shape (F,); one patch if ``None``.
        frame: Axes of the patch of each face, shape (F, 3, 3) or (1, 3, 3); left as they are if ``None``.

    Returns:
        Place in multiples of the root of the patch's mean area and the logarithm of the area over that mean, shape
        (F, 4); the area over that mean, shape (F, 1).

    Example:
        >>> patch_surface(torch.tensor([[0.0, 0, 0, 4], [2, 0, 0, 4]]))[0]
        tensor([[0., 0., 0., 0.],
                [1., 0., 0., 0.]])
    """
    if batch is None:
        batch = surface.new_zeros(surface.size(0), dtype=torch.long)
    ptr = index2ptr(batch, int(batch[-1]) + 1)
    mean = segment_sum(surface[:, 3:], ptr) / ptr.diff().unsqueeze(1)  # (P, 1)
    mean = mean.clamp(min=torch.finfo(mean.dtype).tiny)[batch]
    place, area = surface[:, :3] / mean.sqrt(), (surface[:, 3:] / mean).clamp(min=_SMALLEST)
    if frame is not None:
        place = in_frame(place, frame)
    return torch.cat([place, area.log()], dim=1), area
