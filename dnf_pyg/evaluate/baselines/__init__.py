"""Classical filters to compare with. Each denoises ``pos`` (V, 3) of a mesh with ``face`` (3, F)."""

from collections.abc import Callable

from dnf_pyg.evaluate.baselines.bilateral import BilateralNormalFilter
from dnf_pyg.evaluate.baselines.filtered import Baseline, FilteredMesh
from dnf_pyg.evaluate.baselines.guided import GuidedNormalFilter
from dnf_pyg.evaluate.baselines.l0_minimization import L0Minimization
from dnf_pyg.evaluate.baselines.taubin import TaubinSmoothing
from dnf_pyg.evaluate.baselines.total_variation import TotalVariationFilter

__all__ = [
    "BASELINES",
    "Baseline",
    "BilateralNormalFilter",
    "FilteredMesh",
    "GuidedNormalFilter",
    "L0Minimization",
    "TaubinSmoothing",
    "TotalVariationFilter",
]

BASELINES: dict[str, Callable[[], Baseline]] = {
    "BNF": BilateralNormalFilter,
    "GNF": GuidedNormalFilter,
    "TV": TotalVariationFilter,
    "L0": L0Minimization,
    "Taubin": TaubinSmoothing,
}
"""Filters by name, with their default parameters when called."""
