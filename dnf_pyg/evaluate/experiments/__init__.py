"""The paper's experiments: their meshes, tables and plots."""

from dnf_pyg.evaluate.experiments.ablation import CASES, PAPER_MESHES, Case, ablation_rows, write_ablation
from dnf_pyg.evaluate.experiments.series import SERIES, Input, Series
from dnf_pyg.evaluate.experiments.series_report import write_series

__all__ = [
    "CASES",
    "PAPER_MESHES",
    "SERIES",
    "Case",
    "Input",
    "Series",
    "ablation_rows",
    "write_ablation",
    "write_series",
]
