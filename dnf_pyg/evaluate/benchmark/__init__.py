"""Denoise a folder of test meshes with several methods and report how far each result is from the clean mesh."""

from dnf_pyg.datasets.pairing import find_test_folder
from dnf_pyg.evaluate.benchmark.evaluation import Failure, run_benchmark
from dnf_pyg.evaluate.benchmark.methods import ClassicalMethod, Method, NetworkMethod, OutputFolder, Result
from dnf_pyg.evaluate.benchmark.plots import draw_plots, line_style, new_figure, save_figure
from dnf_pyg.evaluate.benchmark.rows import Row, RowLog, read_published, write_csv, write_json
from dnf_pyg.evaluate.benchmark.score import complete_methods, mesh_thetas, scores, summarize
from dnf_pyg.evaluate.benchmark.tables import markdown, markdown_table, number

__all__ = [
    "ClassicalMethod",
    "Failure",
    "Method",
    "NetworkMethod",
    "OutputFolder",
    "Result",
    "Row",
    "RowLog",
    "complete_methods",
    "draw_plots",
    "find_test_folder",
    "line_style",
    "markdown",
    "markdown_table",
    "mesh_thetas",
    "new_figure",
    "number",
    "read_published",
    "run_benchmark",
    "save_figure",
    "scores",
    "summarize",
    "write_csv",
    "write_json",
]
