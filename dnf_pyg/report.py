"""Pictures of denoised meshes."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from torch import Tensor

from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.raster import Camera, render

__all__ = ["draw_meshes", "normal_error"]

_COLORS = mpl.colormaps["YlOrRd"]


def normal_error(pos: Tensor, reference_pos: Tensor, face: Tensor) -> Tensor:
    """Angle between the facet normals of two meshes with the same faces, (F,), degrees.

    Examples:
        >>> flat = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> upright = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> normal_error(flat, upright, torch.tensor([[0], [1], [2]])).round().tolist()
        [90.0]
    """
    cosine = (face_normals(pos.double(), face) * face_normals(reference_pos.double(), face)).sum(dim=-1)
    return cosine.clamp(-1, 1).arccos().rad2deg()


def draw_meshes(
    path: str | Path,
    meshes: Mapping[str, tuple[Tensor, Tensor]],
    reference: tuple[Tensor, Tensor] | None = None,
    *,
    max_error: float = 30.0,
    size: int = 480,
    view: tuple[float, float, float] = (0.6, 0.5, 1.0),
) -> None:
    """Draw meshes side by side, and below them how far their facet normals are off.

    Args:
        path: Picture to write (png).
        meshes: Positions (V, 3) and faces (3, F) of each mesh by its title, from left to right.
        reference: Clean mesh; meshes with as many faces get an error map against it.
        max_error: Error at the end of the colour scale, degrees.
        size: Pixels per side of each mesh.
        view: Direction that the meshes are seen from; y is up.

    Raises:
        ValueError: If no mesh is given.
    """
    if not meshes:
        raise ValueError("Expected 'meshes' with at least one mesh (got none)")
    camera = Camera.looking_at(torch.cat([pos for pos, _ in meshes.values()]), view)
    rows = 1 if reference is None else 2
    inch = size / 100
    figure = Figure(figsize=(inch * len(meshes) + (0.9 if reference else 0), (inch + 0.35) * rows), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, len(meshes), squeeze=False)
    figure.subplots_adjust(
        0.005, 0.005, 0.995 if reference is None else 1 - 0.85 / figure.get_figwidth(), 0.93, 0.01, 0.1
    )
    for column, (title, (pos, face)) in enumerate(meshes.items()):
        axes[0, column].imshow(render(pos, face, camera, size))
        axes[0, column].set_title(title)
        if reference is None or not torch.equal(reference[1], face):
            continue
        error = normal_error(pos, reference[0], face)
        color = torch.from_numpy(_COLORS((error / max_error).clamp(max=1).numpy())[:, :3])
        axes[1, column].imshow(render(pos, face, camera, size, color))
        axes[1, column].set_title(f"mean error {error.mean():.2f}°")
    for axis in axes.flat:
        axis.set_axis_off()
    if reference is not None:
        scale = ScalarMappable(Normalize(0, max_error), _COLORS)
        left = 1 - 0.75 / figure.get_figwidth()
        bar = figure.add_axes((left, 0.05, 0.2 / figure.get_figwidth(), 0.36))
        figure.colorbar(scale, cax=bar, extend="max", label="error of the facet normal (degrees)")
    figure.savefig(path)
