"""Plots of a benchmark."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dnf_pyg.evaluate.benchmark.means import complete_methods, means, mesh_thetas, names, scores
from dnf_pyg.evaluate.benchmark.rows import Row
from dnf_pyg.view import save_figure

__all__ = ["draw_plots", "draw_scores", "line_style", "plot"]

_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito
_MARKERS = "oDs^vP*X<>p"  # no common divisor with the number of colours, so no two methods look alike


def draw_plots(folder: Path, rows: Sequence[Row]) -> None:
    """Draw theta per mesh, theta per noise level and sorted scores as png.

    Args:
        folder: Where the pictures go: ``theta_by_mesh.png``, ``theta_by_noise.png`` and ``scores.png``.
        rows: All rows; methods that lack some meshes are drawn per mesh only.
    """
    meshes, methods = names(rows, "mesh")[::-1], names(rows, "method")
    with plot(folder / "theta_by_mesh.png", (9, 1.5 + 0.45 * len(meshes))) as axes:
        for number, (method, theta) in enumerate(mesh_thetas(rows).items()):
            size = {"linewidth": 0, "markersize": 5 if number else 8, "zorder": 3 if number else 4}
            places = [meshes.index(mesh) for mesh in theta]
            axes.plot([*theta.values()], places, **line_style(number) | size, label=method)
        axes.set_yticks(range(len(meshes)), meshes)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "235" else "")
        axes.set_xlabel("θ of the mesh, mean of the noise levels (degrees, logarithmic)")
    with plot(folder / "theta_by_noise.png", (8, 4.5)) as axes:
        noises, theta_of = sorted(names(rows, "noise")), means(rows, "theta_deg", "method", "noise")
        for method in complete_methods(rows):
            style = line_style(methods.index(method))
            axes.plot(noises, [theta_of[method, noise] for noise in noises], **style, label=method)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("noise")
        axes.set_ylabel("θ of the mesh, mean of the meshes (degrees)")
    draw_scores(folder / "scores.png", rows)


def draw_scores(path: Path, rows: Sequence[Row]) -> None:
    """Draw the scores of each complete method over the meshes, falling, as in the paper's figure of scores."""
    complete, methods, thetas = complete_methods(rows), names(rows, "method"), mesh_thetas(rows)
    with plot(path, (8, 4.5)) as axes:
        for method, score in scores({method: thetas[method] for method in complete}).items():
            falling = sorted(score.values(), reverse=True)
            axes.plot(range(1, len(falling) + 1), falling, **line_style(methods.index(method)), label=method)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("meshes, for each method from its best to its worst")
        axes.set_ylabel("score of Eq. 4 among these methods")


@contextmanager
def plot(path: Path, size: tuple[float, float]) -> Iterator[Axes]:
    """Give axes to draw on, ``size`` in inches, then add a legend beside them and write the png."""
    with mpl.rc_context({"text.parse_math": False}):  # names of meshes and methods are no formulas
        figure = Figure(figsize=size, dpi=150, layout="constrained")
        axes = figure.subplots()
        axes.grid(alpha=0.3)
        yield axes
        if axes.get_legend_handles_labels()[1]:
            figure.legend(loc="outside right upper", fontsize=8)
        save_figure(figure, path)


def line_style(number: int) -> dict[str, Any]:
    """Look of the line of a method, by its place in the legend: the first is the widest, later ones are dashed."""
    return {
        "color": _COLORS[number % len(_COLORS)],
        "marker": _MARKERS[number % len(_MARKERS)],
        "linestyle": "-" if number < len(_COLORS) else "--",
        "linewidth": 1.2 if number else 2.2,
    }
