"""Classical filters to compare with. Each denoises ``pos`` (V, 3) of a mesh with ``face`` (3, F)."""

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

BASELINES: dict[str, Callable[[], Baseline]] = {
    "BNF": BilateralNormalFilter,
    "GNF": GuidedNormalFilter,
    "Taubin": TaubinSmoothing,
}
"""Filters by name, with their default parameters when called."""
