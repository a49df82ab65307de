"""Scores of Eq. 4 of the paper: every method on every mesh, from 0 for the worst to 1 for the best."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from dnf_pyg.evaluate.benchmark import Row, complete_methods, draw_plots, markdown_table, mesh_thetas, number, scores
from dnf_pyg.io.atomic import write_bytes

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
    methods = complete_methods(rows)
    thetas = {method: of for method, of in mesh_thetas(rows).items() if method in methods}
    score = scores(thetas)
    meshes = list(dict.fromkeys(row.mesh for row in rows))
    lines = [
        [mesh, *(number(score[method][mesh], bold=score[method][mesh] == 1) for method in methods)] for mesh in meshes
    ]
    mean = [number(sum(score[method].values()) / len(meshes)) for method in methods]
    text = markdown_table(["mesh", *methods], [*lines, ["mean", *mean]])
    write_bytes(folder / "scores.md", f"# Scores of Eq. 4\n\n{_EXPLANATION}\n\n{text}\n".encode())
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["mesh", "method", "theta_deg", "score"])
    writer.writerows([m, n, round(thetas[n][m], 4), round(score[n][m], 4)] for m in meshes for n in methods)
    write_bytes(folder / "scores.csv", table.getvalue().encode())
    draw_plots(folder, rows, ["scores.png"])
    return text
