"""Table 1 of the paper: the network without each of its parts, our figures beside the paper's."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dnf_pyg.evaluate.benchmark import Failure, Row, markdown_table, mesh_thetas, new_figure, number, save_figure
from dnf_pyg.io.atomic import write_bytes

__all__ = ["CASES", "PAPER_MESHES", "Case", "ablation_rows", "write_ablation"]

PAPER_MESHES = ("block", "cube", "sphere", "carter100K", "eros100K")

_EXPLANATION = """\
Table 1 of Li et al. 2020: mean angle θ between the facet normals of the denoised mesh (after its vertex update) and of
the clean one, in degrees, mean of the noise levels that each mesh has here. Left our figures, right the paper's. Lowest
of ours in bold. Empty: no run or no such mesh."""


@dataclass(frozen=True)
class Case:
    """A row of the table.

    Attributes:
        title: As the paper calls it.
        runs: Names of the runs that train it, the first that is there counts: those of its config.
        paper: Theta in the paper on each of :data:`PAPER_MESHES`, degrees.
    """

    title: str
    runs: tuple[str, ...]
    paper: tuple[float, ...]


CASES = {
    "wo_inter": Case("w/o inter", ("ablation_wo_inter",), (2.38, 1.38, 2.38, 5.84, 7.21)),
    "wo_reg": Case("w/o reg", ("ablation_wo_reg",), (2.43, 1.13, 2.43, 5.88, 7.20)),
    "wo_sub": Case("w/o sub", ("ablation_wo_sub",), (2.69, 1.42, 2.41, 6.02, 7.23)),
    "1_unit": Case("1 res unit", ("ablation_1_unit",), (2.24, 1.25, 2.41, 5.92, 7.23)),
    "3_units": Case("3 res units", ("ablation_3_units",), (2.12, 1.03, 2.24, 5.86, 7.14)),
    "full": Case("full pipeline", ("ablation_full", "synthetic"), (2.12, 0.96, 2.37, 5.81, 7.20)),
}


def ablation_rows(rows: Sequence[Row]) -> dict[str, dict[str, float | None]]:
    """Theta of each case on each of the paper's meshes, degrees; ``None`` where it was not measured.

    Args:
        rows: Measured rows; ``method`` is a key of :data:`CASES`, meshes are matched whatever their case.

    Example:
        >>> ablation_rows([Row("Cube", "n1", "full", 1.0), Row("Cube", "n2", "full", 2.0)])["full"]["cube"]
        1.5
    """
    thetas = mesh_thetas(rows)
    lower = {key: {mesh.lower(): value for mesh, value in of.items()} for key, of in thetas.items()}
    return {key: {mesh: lower.get(key, {}).get(mesh.lower()) for mesh in PAPER_MESHES} for key in CASES}


def write_ablation(folder: Path, rows: Sequence[Row], failures: Sequence[Failure], sources: Mapping[str, str]) -> str:
    """Write ``ablation.md``, ``ablation.csv`` and ``ablation.png``.

    Args:
        folder: Where they go.
        rows: Measured rows, see :func:`ablation_rows`.
        failures: What gave no result.
        sources: Weights of each case.

    Returns:
        The table as markdown.
    """
    table = ablation_rows(rows)
    lowest = {
        mesh: min((value for of in table.values() if (value := of[mesh]) is not None), default=None)
        for mesh in PAPER_MESHES
    }
    header = ["case", *(f"{mesh} {whose}" for mesh in PAPER_MESHES for whose in ("ours", "paper"))]
    lines = []
    for key, case in CASES.items():
        cells = [case.title]
        for mesh, paper in zip(PAPER_MESHES, case.paper, strict=True):
            value = table[key][mesh]
            cells += [number(value, bold=value is not None and value == lowest[mesh]), number(paper, digits=2)]
        lines.append(cells)
    text = markdown_table(header, lines)
    parts = ["# Table 1: ablation", _EXPLANATION, text, "## Runs", "\n".join(f"- {k}: {v}" for k, v in sources.items())]
    if failures:
        told = "\n".join(f"- {failure.noisy}, {failure.method}: {failure.reason}" for failure in failures)
        parts += ["## Failures", told]
    write_bytes(folder / "ablation.md", ("\n\n".join(parts) + "\n").encode())
    _write_csv(folder / "ablation.csv", table)
    _draw(folder / "ablation.png", table)
    return text


def _write_csv(path: Path, table: Mapping[str, Mapping[str, float | None]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["case", "mesh", "theta_deg", "paper_theta_deg"])
    for key, case in CASES.items():
        for mesh, paper in zip(PAPER_MESHES, case.paper, strict=True):
            value = table[key][mesh]
            writer.writerow([key, mesh, "" if value is None else round(value, 4), paper])
    write_bytes(path, text.getvalue().encode())


def _draw(path: Path, table: Mapping[str, Mapping[str, float | None]]) -> None:
    """A bar for every case and mesh, the paper's figure as a mark across it."""
    meshes = [mesh for mesh in PAPER_MESHES if any(values[mesh] is not None for values in table.values())]
    meshes = meshes or list(PAPER_MESHES)
    figure, axes = new_figure((3 + 1.5 * len(meshes), 4))
    width = 0.8 / len(CASES)
    for row, (key, case) in enumerate(CASES.items()):
        places = [column + (row - (len(CASES) - 1) / 2) * width for column in range(len(meshes))]
        axes.bar(places, [table[key][mesh] or 0.0 for mesh in meshes], 0.9 * width, label=case.title, zorder=2)
        papers = [case.paper[PAPER_MESHES.index(mesh)] for mesh in meshes]
        label = "the paper" if row == len(CASES) - 1 else ""
        axes.hlines(
            papers, [p - width / 2 for p in places], [p + width / 2 for p in places], "black", zorder=3, label=label
        )
    axes.set_xticks(range(len(meshes)), meshes)
    axes.set_ylabel("θ of the mesh (degrees)")
    figure.legend(loc="outside right upper", fontsize=8)
    save_figure(figure, path)
