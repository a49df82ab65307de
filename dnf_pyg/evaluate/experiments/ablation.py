"""Table 1 of the paper: the network without each of its parts, our figures beside the paper's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dnf_pyg.evaluate.benchmark.means import mesh_thetas
from dnf_pyg.evaluate.benchmark.plots import plot
from dnf_pyg.evaluate.benchmark.rows import Failure, Row
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, csv_table, document, markdown_table, number
from dnf_pyg.io.atomic import write_files

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
        title: Its name in the paper.
        runs: Names of the runs that train it, those of its configs; the first one found counts.
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
        rows: Measured rows; ``method`` is a key of :data:`CASES`, names of meshes match in any case.

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
        failures: Methods that gave no result on a mesh.
        sources: Weights of each case.

    Returns:
        The table as markdown.
    """
    table = ablation_rows(rows)
    ours = {mesh: bold_lowest([table[key][mesh] for key in CASES]) for mesh in PAPER_MESHES}
    header = ["case", *(f"{mesh} {whose}" for mesh in PAPER_MESHES for whose in ("ours", "paper"))]
    lines = []
    for row, case in enumerate(CASES.values()):
        cells = ((ours[mesh][row], number(paper, 2)) for mesh, paper in zip(PAPER_MESHES, case.paper, strict=True))
        lines.append([case.title, *(cell for pair in cells for cell in pair)])
    text = markdown_table(header, lines)
    runs = "\n".join(f"- {key}: {source}" for key, source in sources.items())
    measured = csv_table(
        ["case", "mesh", "theta_deg", "paper_theta_deg"],
        (
            [key, mesh, table[key][mesh], paper]
            for key, case in CASES.items()
            for mesh, paper in zip(PAPER_MESHES, case.paper, strict=True)
        ),
    )
    files = {
        "ablation.md": document("Table 1: ablation", [_EXPLANATION, text], {"Runs": runs}, failures),
        "ablation.csv": measured,
    }
    write_files({folder / name: content.encode() for name, content in files.items()})
    _draw(folder / "ablation.png", table)
    return text


def _draw(path: Path, table: Mapping[str, Mapping[str, float | None]]) -> None:
    """Draw a bar for every case and mesh, the paper's figure as a mark across it."""
    shown = [mesh for mesh in PAPER_MESHES if any(values[mesh] is not None for values in table.values())]
    meshes = shown or list(PAPER_MESHES)
    width = 0.8 / len(CASES)
    with plot(path, (3 + 1.5 * len(meshes), 4)) as axes:
        for row, (key, case) in enumerate(CASES.items()):
            places = [column + (row - (len(CASES) - 1) / 2) * width for column in range(len(meshes))]
            axes.bar(places, [table[key][mesh] or 0.0 for mesh in meshes], 0.9 * width, label=case.title, zorder=2)
            papers = [case.paper[PAPER_MESHES.index(mesh)] for mesh in meshes]
            label = "the paper" if row == len(CASES) - 1 else ""
            left, right = ([place + side * width / 2 for place in places] for side in (-1, 1))
            axes.hlines(papers, left, right, "black", zorder=3, label=label)
        axes.set_xticks(range(len(meshes)), meshes)
        axes.set_ylabel("θ of the mesh (degrees)")
