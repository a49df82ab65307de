"""The report of a benchmark as markdown."""

from collections.abc import Iterable, Sequence

from dnf_pyg.evaluate.benchmark.evaluation import Failure
from dnf_pyg.evaluate.benchmark.rows import Row
from dnf_pyg.evaluate.benchmark.score import complete_methods, mesh_thetas, scores

__all__ = ["markdown", "markdown_table", "number"]

_EXPLANATION = """\
θ: mean angle between the facet normals of a mesh and of the clean one, in degrees, over its faces; of the mesh after
its vertex update unless it says otherwise. θ of normals: the same for the normals that the vertices were moved to fit.
E_v: mean distance of the vertices from the clean surface, in mean edge lengths of the clean mesh. Score: 1 for the
lowest θ (mean of the noise levels) among the methods here on a mesh, 0 for the highest, mean over the meshes
(Li et al. 2020, Eq. 4). Means are over all noisy meshes; in brackets the number of them where a method lacks some.
Lowest θ in bold. Seconds: one run each on {threads} thread(s)."""


def markdown(title: str, rows: Sequence[Row], failures: Sequence[Failure] = (), num_threads: int = 1) -> str:
    """Lay out all tables.

    Args:
        title: Heading.
        rows: All rows, of own and of other methods.
        failures: What gave no result.
        num_threads: Threads that the methods ran on.

    Returns:
        The text, to be saved as ``.md``.

    Example:
        >>> text = markdown("Test", [Row("a", "n1", "x", 1.0), Row("a", "n1", "y", 2.0)])
        >>> [line for line in text.splitlines() if line.startswith("| a ")]
        ['| a |  | **1.000** | 2.000 |', '| a | n1 |  | **1.000** | 2.000 |']
    """
    methods = list(dict.fromkeys(row.method for row in rows))
    sections = [
        f"# {title}",
        _EXPLANATION.format(threads=num_threads),
        "## Summary\n\n" + _summary(rows, methods),
        "## θ, mean of the noise levels\n\n" + _by_mesh(rows, methods),
        "## θ\n\n" + _by_noisy_mesh(rows, methods),
        "## Details\n\n" + _details(rows),
        "## Methods\n\n" + _methods(rows, methods),
    ]
    if failures:
        lines = (f"- {failure.noisy}, {failure.method}: {failure.reason}" for failure in failures)
        sections.append("## Failures\n\n" + "\n".join(lines))
    return "\n\n".join(sections) + "\n"


def _summary(rows: Sequence[Row], methods: Sequence[str]) -> str:
    noises = sorted({row.noise for row in rows})
    thetas, complete = mesh_thetas(rows), complete_methods(rows)
    score = scores(thetas)
    best = _best({method: thetas[method] for method in methods})
    mean = {method: _mean(row.theta_deg for row in rows if row.method == method) for method in methods}
    lowest = min((theta for method in complete if (theta := mean[method]) is not None), default=None)
    noisy = {(row.mesh, row.noise): row.theta_noisy_deg for row in rows if row.theta_noisy_deg is not None}
    lines = []
    if noisy:
        level = [number(_mean(t for (_, noise), t in noisy.items() if noise == wanted)) for wanted in noises]
        lines.append(["noisy", *level, number(_mean(noisy.values())), *[""] * 5])
    for method in methods:
        own = [row for row in rows if row.method == method]
        count = "" if method in complete else f" ({len(own)})"
        lines.append(
            [
                method,
                *(number(_mean(row.theta_deg for row in own if row.noise == noise)) for noise in noises),
                number(mean[method], bold=method in complete and mean[method] == lowest) + count,
                number(_mean(row.theta_normals_deg for row in own)),
                number(_mean(row.vertex_error for row in own), digits=4),
                number(_mean(row.seconds for row in own), digits=2),
                number(_mean(score[method].values())),
                str(sum(method in winners for winners in best.values())),
            ]
        )
    header = ["method", *(f"θ {noise}" for noise in noises), "θ mean", "θ of normals", "E_v", "seconds", "score"]
    return markdown_table([*header, "meshes with lowest θ"], lines)


def _by_mesh(rows: Sequence[Row], methods: Sequence[str]) -> str:
    thetas = mesh_thetas(rows)
    best = _best(thetas)
    lines = []
    for mesh in dict.fromkeys(row.mesh for row in rows):
        before = {row.noise: row.theta_noisy_deg for row in rows if row.mesh == mesh and row.theta_noisy_deg}
        values = [number(thetas[method].get(mesh), bold=method in best.get(mesh, ())) for method in methods]
        lines.append([mesh, number(_mean(before.values())), *values])
    return markdown_table(["mesh", "noisy", *methods], lines)


def _by_noisy_mesh(rows: Sequence[Row], methods: Sequence[str]) -> str:
    theta = {(row.mesh, row.noise, row.method): row.theta_deg for row in rows}
    noisy = {(row.mesh, row.noise): row.theta_noisy_deg for row in rows if row.theta_noisy_deg is not None}
    lines = []
    for mesh, noise in dict.fromkeys((row.mesh, row.noise) for row in rows):
        values = [theta.get((mesh, noise, method)) for method in methods]
        lowest = min(value for value in values if value is not None)
        cells = [number(value, bold=value == lowest) for value in values]
        lines.append([mesh, noise, number(noisy.get((mesh, noise))), *cells])
    return markdown_table(["mesh", "noise", "noisy", *methods], lines)


def _details(rows: Sequence[Row]) -> str:
    measured = [row for row in rows if row.vertex_error is not None]
    lines = [
        [
            row.mesh,
            row.noise,
            str(row.num_faces),
            row.method,
            number(row.theta_noisy_deg),
            number(row.theta_normals_deg),
            number(row.theta_deg),
            number(row.vertex_error, digits=4),
            number(row.seconds, digits=2),
        ]
        for row in measured
    ]
    return markdown_table(["mesh", "noise", "faces", "method", "θ noisy", "θ of normals", "θ", "E_v", "seconds"], lines)


def _methods(rows: Sequence[Row], methods: Sequence[str]) -> str:
    lines = []
    for method in methods:
        parameters = list(dict.fromkeys(row.parameters for row in rows if row.method == method))
        lines.append(f"- {method}: {parameters[0] if len(parameters) == 1 else f'{len(parameters)} given meshes'}")
    return "\n".join(lines)


def _best(thetas: dict[str, dict[str, float]]) -> dict[str, set[str]]:
    """Methods with the lowest theta on each mesh."""
    lowest: dict[str, float] = {}
    for by_mesh in thetas.values():
        for mesh, theta in by_mesh.items():
            lowest[mesh] = min(theta, lowest.get(mesh, theta))
    return {
        mesh: {method for method, by_mesh in thetas.items() if by_mesh.get(mesh) == theta}
        for mesh, theta in lowest.items()
    }


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def number(value: float | None, digits: int = 3, bold: bool = False) -> str:
    """A cell of a table; empty for no value."""
    if value is None:
        return ""
    return f"**{value:.{digits}f}**" if bold else f"{value:.{digits}f}"


def markdown_table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table with the first column to the left and the others to the right."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [header, rule, *lines])
