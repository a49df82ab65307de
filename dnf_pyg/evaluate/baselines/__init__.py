"""Classical filters to compare with; each takes and gives ``pos`` (V, 3) and ``face`` (3, F)."""

from collections.abc import Callable

from dnf_pyg.evaluate.baselines.bilateral import BilateralNormalFilter
from dnf_pyg.evaluate.baselines.filtered import Baseline, FilteredMesh
from dnf_pyg.evaluate.baselines.guided import GuidedNormalFilter
from dnf_pyg.evaluate.baselines.taubin import TaubinSmoothing

__all__ = [
    "BASELINES",
    "Baseline",
    "BilateralNormalFilter",
    "FilteredMesh",
    "GuidedNormalFilter",
    "TaubinSmoothing",
]

BASELINES: dict[str, Callable[[int], Baseline]] = {
    "BNF": lambda iterations: BilateralNormalFilter(num_vertex_iterations=iterations),
    "GNF": lambda iterations: GuidedNormalFilter(),
    "Taubin": lambda iterations: TaubinSmoothing(num_vertex_iterations=iterations),
}
"""Filters by name, for a number of vertex iterations after the filter; GNF moves vertices between its own."""
