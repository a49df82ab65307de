"""The paper's experiments: what to denoise, and the tables and plots of what came out."""

from dnf_pyg.evaluate.experiments.ablation import CASES, Case, ablation_rows, write_ablation
from dnf_pyg.evaluate.experiments.scores import write_scores
from dnf_pyg.evaluate.experiments.series import SERIES, Input, Series
from dnf_pyg.evaluate.experiments.series_report import write_series

__all__ = [
    "CASES",
    "SERIES",
    "Case",
    "Input",
    "Series",
    "ablation_rows",
    "write_ablation",
    "write_scores",
    "write_series",
]
