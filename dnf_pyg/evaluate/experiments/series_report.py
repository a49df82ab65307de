"""Table and plot of a test of robustness."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from dnf_pyg.evaluate.benchmark import Failure, Row, line_style, markdown_table, new_figure, number, save_figure
from dnf_pyg.evaluate.experiments.series import Input, Series
from dnf_pyg.io.atomic import write_bytes

__all__ = ["write_series"]

_THETA = """\
Mean angle θ between the facet normals of the denoised mesh (after its vertex update) and of the clean one, in degrees,
mean of the meshes that all methods have at that setting; lowest in bold."""


def write_series(
    folder: Path, name: str, series: Series, inputs: Sequence[Input], rows: Sequence[Row], failures: Sequence[Failure]
) -> str:
    """Write ``NAME.md``, ``NAME.csv`` and ``NAME.png``.

    Args:
        folder: Where they go.
        name: Name of the files.
        series: The series.
        inputs: Its noisy meshes.
        rows: What the methods made of them.
        failures: What gave no result.

    Returns:
        The table of means as markdown.
    """
    of_row = {item.clean.stem: item for item in inputs}
    settings = list(dict.fromkeys(item.setting for item in inputs))
    methods = list(dict.fromkeys(row.method for row in rows))
    theta = {(of_row[row.mesh].mesh, of_row[row.mesh].setting, row.method): row.theta_deg for row in rows}
    before = {(of_row[row.mesh].mesh, of_row[row.mesh].setting, "noisy"): row.theta_noisy_deg or 0.0 for row in rows}
    columns = ["noisy", *methods]
    theta |= before
    means = _means(theta, settings, columns)
    text = markdown_table([series.axis, *columns], [_line(setting, means[setting], methods) for setting in settings])
    parts = [f"# {series.title}", series.explanation, _THETA, text]
    for mesh in dict.fromkeys(item.mesh for item in inputs):
        own = {s: {c: theta[mesh, s, c] for c in columns if (mesh, s, c) in theta} for s in settings}
        parts += [f"## {mesh}", markdown_table([series.axis, *columns], [_line(s, own[s], methods) for s in settings])]
    parts += ["## Methods", "\n".join(f"- {m}: {next(r.parameters for r in rows if r.method == m)}" for m in methods)]
    if failures:
        told = "\n".join(f"- {failure.noisy}, {failure.method}: {failure.reason}" for failure in failures)
        parts += ["## Failures", told]
    write_bytes(folder / f"{name}.md", ("\n\n".join(parts) + "\n").encode())
    _write_csv(folder / f"{name}.csv", of_row, rows)
    _draw(folder / f"{name}.png", series, means, columns)
    return text


def _means(
    theta: Mapping[tuple[str, str, str], float], settings: Sequence[str], columns: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Mean of each column at each setting, over the meshes that every column has there."""
    found: dict[str, dict[str, float]] = {}
    meshes = dict.fromkeys(mesh for mesh, _, _ in theta)
    for setting in settings:
        common = [mesh for mesh in meshes if all((mesh, setting, column) in theta for column in columns)]
        sums = {column: sum(theta[mesh, setting, column] for mesh in common) for column in columns}
        found[setting] = {column: total / len(common) for column, total in sums.items()} if common else {}
    return found


def _line(setting: str, values: Mapping[str, float], methods: Sequence[str]) -> list[str]:
    lowest = min((values[method] for method in methods if method in values), default=None)
    cells = [number(values.get(method), bold=method in values and values[method] == lowest) for method in methods]
    return [setting, number(values.get("noisy")), *cells]


def _write_csv(path: Path, of_row: Mapping[str, Input], rows: Sequence[Row]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["mesh", "setting", "method", "num_faces", "theta_noisy_deg", "theta_deg", "vertex_error", "seconds"]
    )
    for row in rows:
        values = (row.theta_noisy_deg, row.theta_deg, row.vertex_error, row.seconds)
        rounded = ["" if value is None else round(value, 4) for value in values]
        item = of_row[row.mesh]
        writer.writerow([item.mesh, item.setting, row.method, row.num_faces, *rounded])
    write_bytes(path, text.getvalue().encode())


def _draw(path: Path, series: Series, means: Mapping[str, Mapping[str, float]], columns: Sequence[str]) -> None:
    figure, axes = new_figure((7.5, 4))
    for place, column in enumerate(columns):
        known = [(setting, values[column]) for setting, values in means.items() if column in values]
        style = {"color": "0.5", "linestyle": "--"} if column == "noisy" else line_style(place - 1)
        axes.plot([setting for setting, _ in known], [value for _, value in known], **style, label=column)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(series.axis)
    axes.set_ylabel("θ of the mesh, mean of the meshes (degrees)")
    figure.legend(loc="outside right upper", fontsize=8)
    save_figure(figure, path)
