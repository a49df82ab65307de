"""Table and plot of a test of robustness."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dnf_pyg.evaluate.benchmark.means import means, names, noisy_rows
from dnf_pyg.evaluate.benchmark.plots import line_style, plot
from dnf_pyg.evaluate.benchmark.rows import Failure, Row
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, csv_table, document, markdown_table, number
from dnf_pyg.evaluate.experiments.series import Input, Series
from dnf_pyg.io.atomic import write_files

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
        rows: Results of the methods on them.
        failures: Methods that gave no result on a mesh.

    Returns:
        The table of means as markdown.
    """
    source = {item.clean.stem: item for item in inputs}
    rows = [replace(row, mesh=source[row.mesh].mesh, noise=source[row.mesh].setting) for row in rows]
    settings = list(dict.fromkeys(item.setting for item in inputs))
    methods = names(rows, "method")
    everything = [*noisy_rows(rows), *rows]
    complete = {
        (mesh, setting)
        for mesh, setting in {(row.mesh, row.noise) for row in rows}
        if sum((row.mesh, row.noise) == (mesh, setting) for row in rows) == len(methods)
    }
    common = [row for row in everything if (row.mesh, row.noise) in complete]
    text = _table(series, settings, methods, common)
    sections = {
        mesh: _table(series, settings, methods, [row for row in everything if row.mesh == mesh])
        for mesh in dict.fromkeys(item.mesh for item in inputs)
    }
    parameters = {row.method: row.parameters for row in reversed(rows)}
    sections["Methods"] = "\n".join(f"- {method}: {parameters[method]}" for method in methods)
    fields = ["method", "num_faces", "theta_noisy_deg", "theta_deg", "vertex_error", "seconds"]
    measured = csv_table(
        ["mesh", "setting", *fields],
        ([row.mesh, row.noise, *(getattr(row, field) for field in fields)] for row in rows),
    )
    files = {
        f"{name}.md": document(series.title, [series.explanation, _THETA, text], sections, failures),
        f"{name}.csv": measured,
    }
    write_files({folder / file: content.encode() for file, content in files.items()})
    theta = means(common, "theta_deg", "method", "noise")
    is_scale = all(setting.replace(".", "").isdigit() for setting in settings)  # else kinds, which no line joins
    with plot(folder / f"{name}.png", (8, 4.5)) as axes:
        for number_of_line, method in enumerate(methods):
            known = [place for place, setting in enumerate(settings) if (method, setting) in theta]
            style = line_style(number_of_line) | ({} if is_scale else {"linewidth": 0, "markersize": 8})
            axes.plot(known, [theta[method, settings[place]] for place in known], **style, label=method)
        axes.set_xticks(range(len(settings)), _values(series, settings, common))
        axes.set_ylim(bottom=0)
        axes.set_xlabel(series.axis)
        axes.set_ylabel("θ of the mesh, mean of the meshes (degrees)")
    return text


def _table(series: Series, settings: Sequence[str], methods: Sequence[str], rows: Sequence[Row]) -> str:
    """Mean theta of each method at each setting, as markdown."""
    theta = means(rows, "theta_deg", "noise", "method")
    lines = [
        [value, number(theta.get((setting, "noisy"))), *bold_lowest([theta.get((setting, m)) for m in methods])]
        for setting, value in zip(settings, _values(series, settings, rows), strict=True)
    ]
    return markdown_table([series.axis, "noisy", *methods], lines)


def _values(series: Series, settings: Sequence[str], rows: Sequence[Row]) -> list[str]:
    """Value of each setting on the axis; a setting without a result keeps its name."""
    num_faces = means(rows, "num_faces", "noise")
    return [series.value(name, num_faces[name,]) if (name,) in num_faces else name for name in settings]
