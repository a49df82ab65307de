"""Pictures of meshes, side by side and coloured by a value per face."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import matplotlib as mpl
import torch
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from torch import Tensor

from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.mesh.geometry import angular_difference, face_normals
from dnf_pyg.view.camera import Camera
from dnf_pyg.view.movement import scale_end, signed_movement
from dnf_pyg.view.raster import render

__all__ = ["draw_faces", "draw_meshes", "normal_error", "save_figure"]


def normal_error(pos: Tensor, reference_pos: Tensor, face: Tensor) -> Tensor:
    """Angle between the facet normals of two meshes with the same faces, (F,), degrees.

    Examples:
        >>> flat = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> upright = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> normal_error(flat, upright, torch.tensor([[0], [1], [2]])).round().tolist()
        [90.0]
    """
    return angular_difference(face_normals(pos.double(), face), face_normals(reference_pos.double(), face))


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
        value: Value of each face, (F,). Faces with NaN, and all faces by default, are grey, or blue from behind.
        colors: Name of a matplotlib colour map.
        limits: Values at both ends of the colour map; by default the smallest and largest value.
        camera: Where the mesh is seen from; by default :meth:`Camera.choose` decides.
        size: Pixels per side of the picture.

    Returns:
        Colours and limits, for ``figure.colorbar``.

    Example:
        >>> pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
        >>> draw_faces(Figure().subplots(), pos, face, torch.tensor([3.0]), limits=(0, 4)).get_clim()
        (0.0, 4.0)
    """
    value = torch.full((face.size(1),), torch.nan) if value is None else value.detach().double().cpu()
    known = value.isfinite()
    if limits is None:
        limits = (float(value[known].min()), float(value[known].max())) if known.any() else (0.0, 1.0)
    scale = ScalarMappable(Normalize(*limits), mpl.colormaps[colors])
    color = torch.full((face.size(1), 3), torch.nan, dtype=torch.float64)
    color[known] = torch.from_numpy(scale.to_rgba(value[known].numpy())[:, :3])
    axis.imshow(render(pos, face, camera or Camera.choose((pos, face)), size, color))
    axis.set_axis_off()
    return scale


def draw_meshes(
    path: str | Path | BinaryIO,
    meshes: Mapping[str, tuple[Tensor, Tensor]],
    reference: tuple[Tensor, Tensor] | None = None,
    *,
    moved: tuple[str, str] | None = None,
    max_error: float = 30.0,
    size: int = 480,
    camera: Camera | None = None,
) -> None:
    """Draw meshes side by side, and below them the angular error of their facet normals.

    Args:
        path: Picture to write (png), a file or a stream.
        meshes: Positions (V, 3) and faces (3, F) of each mesh by its title, from left to right.
        reference: Clean mesh; meshes with the same faces get an error map against it.
        moved: Titles of two meshes with the same faces. One more picture, in the place of the error map of the
            reference itself if that is among the meshes, shows how far the vertices moved outwards (red) and inwards
            (blue) from the first to the second.
        max_error: Error at the end of the colour scale, degrees.
        size: Pixels per side of each mesh.
        camera: Where the meshes are seen from; by default :meth:`Camera.choose` decides.

    Raises:
        OutputError: If the picture cannot be written.
        ValueError: If no mesh is given.
    """
    if not meshes:
        raise ValueError("Expected 'meshes' with at least one mesh (got none). Pass positions and faces by title.")
    camera = camera or Camera.choose(*meshes.values())
    spare = [i for i, (pos, _) in enumerate(meshes.values()) if reference and torch.equal(pos, reference[0])][:1]
    rows, columns = (1 if reference is None else 2), len(meshes) + (moved is not None and not spare)
    inch = size / 100
    width, font = inch * columns + (1.0 if reference else 0), min(8 + size / 80, 15)
    foot = 0.0 if moved is None else 0.06 * inch + 0.04 * font  # of the movement's scale
    height = (inch + 0.4) * rows + foot
    figure = Figure(figsize=(width, height), dpi=100)
    axes = figure.subplots(rows, columns, squeeze=False)
    right = 1 - 0.95 / width if reference else 0.995
    figure.subplots_adjust(0.005, 0.005 + foot / height, right, 1 - 0.4 / height, 0.01, 0.4 / inch)
    for axis in axes.flat:
        axis.set_axis_off()
    scale = None
    for column, (title, (pos, face)) in enumerate(meshes.items()):
        draw_faces(axes[0, column], pos, face, camera=camera, size=size)
        axes[0, column].set_title(title, parse_math=False, fontsize=font)
        if moved is not None and column in spare:
            continue
        if reference is not None and torch.equal(reference[1], face):
            error = normal_error(pos, reference[0], face)
            axis, limits = axes[1, column], (0.0, max_error)
            scale = draw_faces(axis, pos, face, error, colors="YlOrRd", limits=limits, camera=camera, size=size)
            axis.set_title(f"mean error {error.mean():.2f}°", fontsize=font)
    if scale is not None:
        place = (1 - 0.85 / width, (foot + 0.1 * inch) / height, 0.2 / width, 0.8 * inch / height)
        bar = figure.colorbar(scale, cax=figure.add_axes(place), extend="max")
        bar.set_label("error of the facet normal (degrees)", fontsize=0.8 * font)
    if moved is not None:
        (before, face), (after, _) = (meshes[title] for title in moved)
        _draw_movement(axes[-1, spare[0] if spare else -1], before, after, face, camera, size, font)
    save_figure(figure, path)


def _draw_movement(
    axis: Axes, before: Tensor, after: Tensor, face: Tensor, camera: Camera, size: int, font: float
) -> None:
    value = signed_movement(before, after, face)[face].mean(dim=0)
    end = scale_end(value)
    scale = draw_faces(axis, after, face, value, colors="RdBu_r", limits=(-end, end), camera=camera, size=size)
    axis.set_title("moved out (red), in (blue)", fontsize=font)
    bar = axis.figure.colorbar(scale, cax=axis.inset_axes((0.25, -0.05, 0.5, 0.025)), orientation="horizontal")
    bar.set_ticks([-end, 0, end], labels=[f"{-end:g}", "0", f"{end:g}"], fontsize=0.7 * font)
    bar.set_label("mean edge lengths", fontsize=0.7 * font)


def save_figure(figure: Figure, path: str | Path | BinaryIO) -> None:
    """Write a figure as png to a stream, or to a file that appears whole or not at all.

    Raises:
        OutputError: If the file cannot be written.
    """
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    if isinstance(path, str | Path):
        write_bytes(Path(path), picture.getvalue())
    else:
        path.write(picture.getvalue())
