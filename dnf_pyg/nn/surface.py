"""Places and areas of the faces of a patch, in units of the patch."""

import torch
from torch import Tensor
from torch_geometric.index import index2ptr

from dnf_pyg.nn.kernels.segment import segment_mean

__all__ = ["patch_surface"]

_SMALLEST = 1e-4  # relative area below which all faces count alike
_FARTHEST = 1e4  # place, of a face beside needles; 800 faces in a row reach 1,200


@torch.no_grad()
def patch_surface(pos: Tensor, area: Tensor, batch: Tensor | None = None) -> tuple[Tensor, Tensor]:
    """Divide places and areas by the size of the faces of their patch.

    Args:
        pos: Face centroids, shape (F, 3), model units.
        area: Face areas, shape (F,), squared model units.
        batch: Patch of each face, sorted, shape (F,); one patch if ``None``.

    Returns:
        Places in multiples of the root of the patch's mean area, up to 1e4, shape (F, 3), and areas in multiples of
        that mean, at least 1e-4, shape (F, 1).

    Example:
        >>> patch_surface(torch.tensor([[0.0, 0, 0], [2, 0, 0]]), torch.tensor([4.0, 4.0]))[0]
        tensor([[0., 0., 0.],
                [1., 0., 0.]])
    """
    area = area.unsqueeze(1)
    if batch is None:
        mean = area.mean(dim=0, keepdim=True)
    else:
        mean = segment_mean(area, index2ptr(batch, int(batch[-1]) + 1))[batch]
    mean = mean.clamp(min=torch.finfo(area.dtype).tiny)
    return (pos / mean.sqrt()).clamp(-_FARTHEST, _FARTHEST), (area / mean).clamp(min=_SMALLEST)
