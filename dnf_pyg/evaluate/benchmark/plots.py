"""Plots of a benchmark."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dnf_pyg.evaluate.benchmark.rows import Row
from dnf_pyg.evaluate.benchmark.score import complete_methods, mesh_thetas, scores
from dnf_pyg.io.atomic import write_bytes

__all__ = ["draw_plots", "line_style", "new_figure", "save_figure"]

_MARKERS = "oDs^vP*X<>"


def draw_plots(folder: Path, rows: Sequence[Row], names: Sequence[str] | None = None) -> list[Path]:
    """Draw theta per mesh, theta per noise level and sorted scores as png.

    Args:
        folder: Where the pictures go.
        rows: All rows; those of methods that lack some meshes are drawn per mesh only.
        names: File names of those plots that are wanted; all if not given.

    Returns:
        The files written.
    """
    methods = list(dict.fromkeys(row.method for row in rows))
    meshes = list(dict.fromkeys(row.mesh for row in rows))
    style = {method: line_style(number) for number, method in enumerate(methods)}
    plots = {
        "theta_by_mesh.png": (_draw_meshes, (9, 1.5 + 0.45 * len(meshes))),
        "theta_by_noise.png": (_draw_levels, (8, 4.5)),
        "scores.png": (_draw_scores, (8, 4.5)),
    }
    paths = [folder / name for name in plots if names is None or name in names]
    for path in paths:
        draw, size = plots[path.name]
        figure, axes = new_figure(size)
        draw(axes, rows, style)
        if rows:
            figure.legend(loc="outside right upper", fontsize=8)
        save_figure(figure, path)
    return paths


def new_figure(size: tuple[float, float]) -> tuple[Figure, Axes]:
    """A picture that needs no display, ``size`` in inches, and its only axes."""
    figure = Figure(figsize=size, dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.grid(alpha=0.3)
    return figure, axes


def save_figure(figure: Figure, path: Path) -> None:
    """Write a picture as png, whole or not at all."""
    picture = io.BytesIO()
    figure.savefig(picture)
    write_bytes(path, picture.getvalue())


def line_style(number: int) -> dict[str, Any]:
    """Colour, marker and width of the line of a method, by its place in the legend."""
    color = mpl.colormaps["tab10"](1 + (number - 1) % 9 if number else 0)  # the first method's is its own
    marker = _MARKERS[(number + 2 * ((number - 1) // 9)) % len(_MARKERS)]  # another one where colours begin again
    return {"color": color, "marker": marker, "linewidth": 2.2 if number == 0 else 1.2}


def _draw_meshes(axes: Axes, rows: Sequence[Row], style: dict[str, dict[str, Any]]) -> None:
    """Theta of every method on every mesh, mean of the noise levels, a line of markers per mesh."""
    meshes = list(dict.fromkeys(row.mesh for row in rows))[::-1]
    thetas = mesh_thetas(rows)
    for method, marks in style.items():
        if not thetas[method]:
            continue
        known = [(thetas[method][mesh], place) for place, mesh in enumerate(meshes) if mesh in thetas[method]]
        first = method == next(iter(style))
        marks = {**marks, "linewidth": 0, "markersize": 8 if first else 5, "zorder": 4 if first else 3}
        axes.plot([theta for theta, _ in known], [place for _, place in known], **marks, label=method)
    axes.set_yticks(range(len(meshes)), meshes)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "25" else "")
    axes.set_xlabel("θ of the mesh, mean of the noise levels (degrees, logarithmic)")


def _draw_levels(axes: Axes, rows: Sequence[Row], style: dict[str, dict[str, Any]]) -> None:
    """Mean theta over the meshes, by noise level."""
    noises = sorted({row.noise for row in rows})
    for method in complete_methods(rows):
        thetas = [[row.theta_deg for row in rows if (row.method, row.noise) == (method, noise)] for noise in noises]
        axes.plot(noises, [sum(theta) / len(theta) for theta in thetas], **style[method], label=method)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("noise")
    axes.set_ylabel("θ of the mesh, mean of the meshes (degrees)")


def _draw_scores(axes: Axes, rows: Sequence[Row], style: dict[str, dict[str, Any]]) -> None:
    """Scores of each method over the meshes, falling, as in the paper's figure of scores."""
    complete = complete_methods(rows)
    score = scores({method: thetas for method, thetas in mesh_thetas(rows).items() if method in complete})
    for method in complete:
        falling = sorted(score[method].values(), reverse=True)
        axes.plot(range(1, len(falling) + 1), falling, **style[method], label=method)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("meshes, for each method from its best to its worst")
    axes.set_ylabel("score of Eq. 4 among these methods")
