"""Scores of Eq. 4 of the paper: every method on every mesh, from 0 for the worst to 1 for the best."""

from collections.abc import Sequence
from pathlib import Path

from dnf_pyg.evaluate.benchmark.means import complete_methods, mesh_thetas, names, scores
from dnf_pyg.evaluate.benchmark.plots import draw_scores
from dnf_pyg.evaluate.benchmark.rows import Row
from dnf_pyg.evaluate.benchmark.tables import csv_table, document, markdown_table, number
from dnf_pyg.io.atomic import write_files

__all__ = ["write_scores"]

_EXPLANATION = """\
Score of Li et al. 2020, Eq. (4): 1 for the lowest θ (mean of the noise levels) among the methods here on a mesh, 0 for
the highest; only methods that have a result on every noisy mesh. The plot sorts each method's scores from best to
worst, as the paper's figure does."""


def write_scores(folder: Path, rows: Sequence[Row]) -> str:
    """Write ``scores.md``, ``scores.csv`` and ``scores.png``.

    Args:
        folder: Where they go.
        rows: All rows.

    Returns:
        The table as markdown.
    """
    meshes, thetas = names(rows, "mesh"), mesh_thetas(rows)
    score = scores({method: thetas[method] for method in complete_methods(rows)})
    lines = [[mesh, *(number(of[mesh], bold=of[mesh] == 1) for of in score.values())] for mesh in meshes]
    mean = [number(sum(of.values()) / len(meshes)) for of in score.values()]
    text = markdown_table(["mesh", *score], [*lines, ["mean", *mean]])
    table = csv_table(
        ["mesh", "method", "theta_deg", "score"],
        ([mesh, method, thetas[method][mesh], score[method][mesh]] for mesh in meshes for method in score),
    )
    files = {"scores.md": document("Scores of Eq. 4", [_EXPLANATION, text], {}), "scores.csv": table}
    write_files({folder / name: content.encode() for name, content in files.items()})
    draw_scores(folder / "scores.png", rows)
    return text
