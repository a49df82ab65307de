"""Classical filters to compare with; each takes and gives ``pos`` (V, 3) and ``face`` (3, F)."""

from dnf_pyg.baselines.bilateral import BilateralNormalFilter
from dnf_pyg.baselines.filtered import Baseline, FilteredMesh
from dnf_pyg.baselines.guided import GuidedNormalFilter
from dnf_pyg.baselines.taubin import TaubinSmoothing

__all__ = [
    "BASELINES",
    "Baseline",
    "BilateralNormalFilter",
    "FilteredMesh",
    "GuidedNormalFilter",
    "TaubinSmoothing",
]

BASELINES: dict[str, type[Baseline]] = {
    "BNF": BilateralNormalFilter,
    "GNF": GuidedNormalFilter,
    "Taubin": TaubinSmoothing,
}
