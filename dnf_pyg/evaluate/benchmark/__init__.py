"""Denoise a folder of test meshes with several methods and measure every result against the clean mesh."""

from dnf_pyg.evaluate.benchmark.evaluation import Store, run_benchmark
from dnf_pyg.evaluate.benchmark.means import complete_methods, means, mesh_thetas, names, noisy_rows, scores, summarize
from dnf_pyg.evaluate.benchmark.methods import (
    ClassicalMethod,
    Method,
    NetworkMethod,
    OutputFolder,
    Result,
    VertexUpdate,
)
from dnf_pyg.evaluate.benchmark.plots import draw_plots, draw_scores, line_style, plot
from dnf_pyg.evaluate.benchmark.report import markdown, summary_table, write_results
from dnf_pyg.evaluate.benchmark.rows import Failure, Row, RowLog, read_published, read_results
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, csv_table, document, markdown_table, number

__all__ = [
    "ClassicalMethod",
    "Failure",
    "Method",
    "NetworkMethod",
    "OutputFolder",
    "Result",
    "Row",
    "RowLog",
    "Store",
    "VertexUpdate",
    "bold_lowest",
    "complete_methods",
    "csv_table",
    "document",
    "draw_plots",
    "draw_scores",
    "line_style",
    "markdown",
    "markdown_table",
    "means",
    "mesh_thetas",
    "names",
    "noisy_rows",
    "number",
    "plot",
    "read_published",
    "read_results",
    "run_benchmark",
    "scores",
    "summarize",
    "summary_table",
    "write_results",
]
