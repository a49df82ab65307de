"""Meshes in notebooks: pictures coloured by a value per face, and pages with 3D views in a cell."""

from html import escape
from pathlib import Path

import matplotlib as mpl
import torch
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from torch import Tensor

from dnf_pyg.errors import DataError
from dnf_pyg.view.raster import Camera, render

__all__ = ["PageView", "draw_faces"]


class PageView:
    """Show a page written by :func:`~dnf_pyg.view.report.write_report` where it is the last value of a notebook's cell.

    The page is copied into the notebook, so that it works without network and after the file is gone.

    Args:
        path: The page.
        height: Height of the frame, CSS pixels.

    Raises:
        DataError: If the page cannot be read.

    Example:
        >>> PageView("absent.html")
        Traceback (most recent call last):
        dnf_pyg.errors.DataError: Expected a page (got 'absent.html': No such file or directory): write it first
    """

    def __init__(self, path: str | Path, height: int = 720) -> None:
        try:
            self.page = Path(path).read_text(encoding="utf-8")
        except OSError as error:
            raise DataError(f"Expected a page (got '{path}': {error.strerror}): write it first") from error
        self.height = height

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe srcdoc="{escape(self.page)}" style="{style}"></iframe>'


def draw_faces(
    axis: Axes,
    pos: Tensor,
    face: Tensor,
    value: Tensor | None = None,
    *,
    colors: str = "viridis",
    limits: tuple[float, float] | None = None,
    camera: Camera | None = None,
    size: int = 400,
) -> ScalarMappable:
    """Draw a mesh into a matplotlib figure, its faces coloured by a value.

    Args:
        axis: Where to draw; ticks and frame are removed.
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        value: Value of each face, (F,); NaN, and all faces if not given, stay grey.
        colors: Name of a matplotlib colour map.
        limits: Values at both ends of the colour map; the smallest and largest value if not given.
        camera: Where the mesh is seen from; it fills the picture if not given.
        size: Pixels per side of the picture.

    Returns:
        Colours and limits, for ``figure.colorbar``.

    Example:
        >>> from matplotlib.figure import Figure
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> draw_faces(Figure().subplots(), pos, face, torch.tensor([3.0]), limits=(0, 4)).get_clim()
        (0.0, 4.0)
    """
    value = torch.full((face.size(1),), torch.nan) if value is None else value.detach().double().cpu()
    known = value.isfinite()
    if limits is None:
        limits = (float(value[known].min()), float(value[known].max())) if known.any() else (0.0, 1.0)
    scale = ScalarMappable(Normalize(*limits), mpl.colormaps[colors])
    color = torch.full((face.size(1), 3), 0.82, dtype=torch.float64)
    color[known] = torch.from_numpy(scale.to_rgba(value[known].numpy())[:, :3])
    axis.imshow(render(pos, face, camera or Camera.looking_at(pos), size, color))
    axis.set_axis_off()
    return scale
