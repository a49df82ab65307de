"""Tables, plots and files of a benchmark."""

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from importlib.metadata import version
from pathlib import Path

import torch

from dnf_pyg.evaluate.benchmark.means import (
    complete_methods,
    means,
    mesh_thetas,
    names,
    noisy_rows,
    scores,
    summarize,
)
from dnf_pyg.evaluate.benchmark.plots import draw_plots
from dnf_pyg.evaluate.benchmark.rows import Failure, Row
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, csv_table, document, markdown_table, number
from dnf_pyg.io.atomic import write_files

__all__ = ["markdown", "summary_table", "write_results"]

_EXPLANATION = """\
θ: mean angle between the facet normals of a mesh and of the clean one, in degrees, over its faces; of the mesh after
its vertex update unless stated otherwise. θ of normals: the same for the normals that the vertices were moved to fit.
E_v: mean distance of the vertices from the clean surface, in mean edge lengths of the clean mesh. Score: 1 for the
lowest θ (mean of the noise levels) among the methods here on a mesh, 0 for the highest, mean over the meshes
(Li et al. 2020, Eq. 4). Means are over all noisy meshes; in brackets the number of them where a method lacks some.
Lowest θ in bold. Seconds: one run each on {threads} thread(s). All figures of each mesh are in results.csv."""


def write_results(folder: Path, data: str, rows: Sequence[Row], failures: Sequence[Failure], seed: int) -> None:
    """Write ``results.md``, ``results.csv``, ``results.json`` and the plots of :func:`draw_plots`.

    Args:
        folder: Where they go.
        data: Name of the test set.
        rows: All rows, of own and of other methods.
        failures: Methods that gave no result on a mesh.
        seed: Seed of the choice of patches.

    Raises:
        OutputError: If a file cannot be written.
    """
    measured = [row for row in rows if row.vertex_error is not None]
    content = {
        "data": data,
        "seed": seed,
        "versions": {"dnf_pyg": version("dnf-pyg"), "torch": torch.__version__},
        "num_threads": torch.get_num_threads(),
        "failures": [asdict(failure) for failure in failures],
        "summary": {
            method: summarize([row for row in measured if row.method == method], data)
            for method in names(measured, "method")
        },
        "rows": [
            {key: round(value, 4) if isinstance(value, float) else value for key, value in asdict(row).items()}
            for row in rows
        ],
    }
    texts = {
        "results.md": markdown(f"Benchmark on {data}", rows, failures, torch.get_num_threads()),
        "results.csv": csv_table([field.name for field in fields(Row)], (asdict(row).values() for row in rows)),
        "results.json": json.dumps(content, indent=1) + "\n",
    }
    write_files({folder / name: text.encode(errors="backslashreplace") for name, text in texts.items()})
    draw_plots(folder, rows)


def markdown(title: str, rows: Sequence[Row], failures: Sequence[Failure] = (), num_threads: int = 1) -> str:
    """Lay out all tables.

    Args:
        title: Heading.
        rows: All rows, of own and of other methods.
        failures: Methods that gave no result on a mesh.
        num_threads: Threads that the methods ran on.

    Returns:
        The text, to be saved as ``.md``.

    Example:
        >>> text = markdown("Test", [Row("a", "n1", "x", 1.0), Row("a", "n1", "y", 2.0)])
        >>> [line for line in text.splitlines() if line.startswith("| a ")]
        ['| a |  | **1.000** | 2.000 |', '| a | n1 |  | **1.000** | 2.000 |']
    """
    sections = {
        "Summary": summary_table(rows),
        "θ, mean of the noise levels": _by_mesh(rows),
        "θ": _by_noisy_mesh(rows),
        "Methods": _methods(rows),
    }
    return document(title, [_EXPLANATION.format(threads=num_threads)], sections, failures)


def summary_table(rows: Sequence[Row]) -> str:
    """Lay out the means of every method over the noisy meshes, as markdown."""
    noises = sorted(names(rows, "noise"))
    with_noisy = [*noisy_rows(rows), *rows]
    complete, score = complete_methods(with_noisy), scores(mesh_thetas(rows))
    by_noise = means(with_noisy, "theta_deg", "method", "noise")
    fields = ("theta_deg", "theta_normals_deg", "vertex_error", "seconds")
    theta, theta_normals, vertex_error, seconds = (means(with_noisy, field, "method") for field in fields)
    lowest = min((theta[method,] for method in complete if method != "noisy"), default=None)
    lines = []
    for method in names(with_noisy, "method"):
        count = "" if method in complete else f" ({sum(row.method == method for row in with_noisy)})"
        bold = method in complete and theta[method,] == lowest
        own = [*score.get(method, {}).values()]
        lines.append(
            [
                method,
                *(number(by_noise.get((method, noise))) for noise in noises),
                number(theta[method,], bold=bold) + count,
                number(theta_normals.get((method,))),
                number(vertex_error.get((method,)), digits=4),
                number(seconds.get((method,)), digits=2),
                number(sum(own) / len(own) if own else None),
                str(sum(value == 1 for value in own)) if method in score else "",
            ]
        )
    header = ["method", *(f"θ {noise}" for noise in noises), "θ mean", "θ of normals", "E_v", "seconds", "score"]
    return markdown_table([*header, "meshes with lowest θ"], lines)


def _by_mesh(rows: Sequence[Row]) -> str:
    thetas, before = mesh_thetas(rows), means(noisy_rows(rows), "theta_deg", "mesh")
    lines = [
        [mesh, number(before.get((mesh,))), *bold_lowest([by_mesh.get(mesh) for by_mesh in thetas.values()])]
        for mesh in names(rows, "mesh")
    ]
    return markdown_table(["mesh", "noisy", *thetas], lines)


def _by_noisy_mesh(rows: Sequence[Row]) -> str:
    methods = names(rows, "method")
    theta = means([*noisy_rows(rows), *rows], "theta_deg", "mesh", "noise", "method")
    lines = [
        [*case, number(theta.get((*case, "noisy"))), *bold_lowest([theta.get((*case, method)) for method in methods])]
        for case in dict.fromkeys((row.mesh, row.noise) for row in rows)
    ]
    return markdown_table(["mesh", "noise", "noisy", *methods], lines)


def _methods(rows: Sequence[Row]) -> str:
    lines = []
    for method in names(rows, "method"):
        parameters = names([row for row in rows if row.method == method], "parameters")
        lines.append(f"- {method}: {parameters[0] if len(parameters) == 1 else f'{len(parameters)} given meshes'}")
    return "\n".join(lines)
