"""Denoise a folder of test meshes with several methods and measure every result against the clean mesh."""

from dnf_pyg.evaluate.benchmark.evaluation import Store, run_benchmark
from dnf_pyg.evaluate.benchmark.means import scores, summarize
from dnf_pyg.evaluate.benchmark.methods import (
    ClassicalMethod,
    Method,
    NetworkMethod,
    OutputFolder,
    Result,
)
from dnf_pyg.evaluate.benchmark.report import summary_table, write_results
from dnf_pyg.evaluate.benchmark.rows import Failure, Row, RowLog, read_published, read_results

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
    "read_published",
    "read_results",
    "run_benchmark",
    "scores",
    "summarize",
    "summary_table",
    "write_results",
]
