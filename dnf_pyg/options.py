"""Options of :func:`dnf_pyg.denoise` and of what shows its results.

Python, the command line and YAML files share these names. The module does not import torch, so that the command line
knows its options before anything heavy is loaded.
"""

from dataclasses import dataclass, field
from typing import Literal, TypeVar

from dnf_pyg.errors import OptionError

__all__ = ["DEFAULT_WEIGHTS", "FAST", "Direction", "FilterOptions", "UpdateOptions", "check_range", "expert"]

T = TypeVar("T")

DEFAULT_WEIGHTS = "best"
"""Name of the packaged weights that are used if none are given."""

_CORRELATED_SHARE = 0.25  # of the smoothing for white noise: scans have detail of the size of their noise

Direction = Literal["auto", "x", "-x", "y", "-y", "z", "-z"]
"""The axis from whose end pictures and pages show a mesh; auto chooses a direction that suits it."""


def expert(default: T) -> T:
    """Default of an option that the help of the command line lists among the expert options."""
    return field(default=default, metadata={"expert": True})


def check_range(name: str, value: float, kind: type[int] | type[float], lowest: float, highest: float) -> None:
    """Raise unless an option is a number of the given kind and within its range.

    Raises:
        OptionError: If it is not.

    Example:
        >>> check_range("strength", 2.0, float, 0, 1)
        Traceback (most recent call last):
        dnf_pyg.errors.OptionError: Expected 'strength' to be a number from 0 to 1 (got 2.0). Choose a number ...
    """
    is_number = isinstance(value, int if kind is int else (int, float)) and not isinstance(value, bool)
    if not is_number or not lowest <= value <= highest:
        noun = "a whole number" if kind is int else "a number"
        limits = f"of at least {lowest:g}" if highest == float("inf") else f"from {lowest} to {highest}"
        raise OptionError(f"Expected '{name}' to be {noun} {limits} (got {value}). Choose a number in this range.")


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise OptionError(f"Expected '{name}' to be one of {', '.join(choices)} (got {value}). Choose one of these.")


@dataclass(frozen=True)
class FilterOptions:
    """How the facet normals of a mesh are filtered.

    Args:
        device: Device on which the network runs: cpu, cuda, cuda:1, mps; auto is cuda where there is such a device, and
            cpu elsewhere.
        k: Neighbours per face on each level of the network, spread over those it was trained with; all of them if not
            given.
        patch_size: Faces per patch.
        coverage: Number of patches that every face lies in, at least. More overlap is better and slower.
        growth: Geodesic distance by which patches grow: dijkstra follows shortest paths over the faces, heat uses the
            heat method.
        batch_size: Patches per call of the network, or as many smaller ones as have that many faces. Fewer need less
            memory.
        smoothing: Filtered normals are smoothed where they differ from their mean over the faces around by less than
            about this share of the angle by which the noise turns normals, which leaves detail and sharp edges as they
            are; 0 for none. If not given, white noise has the share of the network
            (:attr:`~dnf_pyg.nn.FilteringNetwork.smoothing`: 0.2 for `single`, 0.05 for the second network of `best`,
            0.5 for `synthetic`), and noise that is estimated to be correlated between neighbouring vertices a quarter
            of it.
        num_coarser: Number of coarser versions of the mesh, each with a sixth of the faces, that are denoised before
            it. If not given, this is 0 for white noise, and 1 for noise that is estimated to be correlated between
            neighbouring vertices.
        seed: Seed of the choice of patches. The same seed gives the same result.
        precision: Precision of the matrix products: bf16 is faster on hardware that supports it. auto takes it on a
            processor with instructions for it (AMX, AVX512_BF16), where theta changes by less than 0.01 degrees, and
            fp32 elsewhere.

    Raises:
        OptionError: If an option is out of its range.

    Example:
        >>> FilterOptions(coverage=3).patch_size
        800
    """

    device: str = "auto"
    k: tuple[int, ...] | None = expert(None)
    patch_size: int = expert(800)
    coverage: int = expert(2)
    growth: Literal["dijkstra", "heat"] = expert("dijkstra")
    batch_size: int = expert(4)
    smoothing: float | None = expert(None)
    num_coarser: int | None = expert(None)
    seed: int = expert(0)
    precision: Literal["auto", "fp32", "bf16"] = expert("auto")

    def __post_init__(self) -> None:
        for number in () if self.k is None else self.k:
            check_range("k", number, int, 1, float("inf"))
        check_range("patch_size", self.patch_size, int, 1, 2**15 - 1)  # patches number their faces in int16
        check_range("coverage", self.coverage, int, 1, float("inf"))
        check_range("batch_size", self.batch_size, int, 1, float("inf"))
        if self.smoothing is not None:
            check_range("smoothing", self.smoothing, float, 0, 1)
        if self.num_coarser is not None:
            check_range("num_coarser", self.num_coarser, int, 0, float("inf"))
        check_range("seed", self.seed, int, 0, 2**63 - 1)
        _check_choice("growth", self.growth, ("dijkstra", "heat"))
        _check_choice("precision", self.precision, ("auto", "fp32", "bf16"))

    def coarser_versions(self, is_correlated: bool) -> int:
        """Number of coarser versions that are denoised first, for white or correlated noise."""
        if self.num_coarser is not None:
            return self.num_coarser
        return 1 if is_correlated else 0

    def smoothed_share(self, is_correlated: bool, suited: float) -> float:
        """Share of the angle of the noise up to which differences are smoothed.

        Args:
            is_correlated: Whether the noise is correlated rather than white.
            suited: Share that suits the network, for white noise.
        """
        if self.smoothing is not None:
            return self.smoothing
        return suited * (_CORRELATED_SHARE if is_correlated else 1.0)


@dataclass(frozen=True)
class UpdateOptions:
    """How vertices are moved to fit the filtered normals.

    Args:
        strength: Fraction of the full movement, from 0 (the mesh stays as it is) to 1.
        max_move: Largest displacement of a vertex, in mean edge lengths.
        max_excess: Vertices stay in place where the filtered normals differ from those of the mesh by more than this
            multiple of what the estimated noise explains, and where there is too little noise to tell it from the
            shape. Use infinity to move all, for example to smooth the stairs of a mesh made from voxels.
        num_iterations: Maximum number of iterations of the vertex update.
        early_stopping: Whether the update ends at the smallest estimated error; from there on it removes detail. The
            estimate holds for noise that is independent between neighbouring vertices: auto ends the update early
            unless the noise is estimated to be correlated, always and never do not depend on that.
        preserve_boundary: Keep vertices on open boundaries in place.

    Raises:
        OptionError: If an option is out of its range.

    Example:
        >>> UpdateOptions(strength=0.5).num_iterations
        100
    """

    strength: float = 1.0
    max_move: float = float("inf")
    max_excess: float = 1.6
    num_iterations: int = expert(100)
    early_stopping: Literal["auto", "always", "never"] = expert("auto")
    preserve_boundary: bool = False

    def __post_init__(self) -> None:
        check_range("strength", self.strength, float, 0, 1)
        check_range("max_move", self.max_move, float, 0, float("inf"))
        check_range("max_excess", self.max_excess, float, 0, float("inf"))
        check_range("num_iterations", self.num_iterations, int, 0, float("inf"))
        _check_choice("early_stopping", self.early_stopping, ("auto", "always", "never"))

    def stops_early(self, is_correlated: bool) -> bool:
        """Whether the update ends at the smallest estimated error, for white or correlated noise."""
        return self.early_stopping == "always" or (self.early_stopping == "auto" and not is_correlated)


FAST = FilterOptions(coverage=1, k=(10, 16, 24))
"""Options that halve the time and cost 0.03 degrees on average: ``denoise(mesh, filtering=FAST)``."""
