"""List the weights that come with the package."""

from dnf_pyg.commands.options import WeightsOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.errors import WeightsError
from dnf_pyg.options import DEFAULT_WEIGHTS
from dnf_pyg.weights.release import Release, packaged_releases

__all__ = ["release_lines", "run"]


def run(options: WeightsOptions) -> None:
    """Print name, description, theta, licence and checksum of all packaged weights.

    Raises:
        WeightsError: If weights lack their model card, or do not have the checksum that it states.
    """
    releases = packaged_releases()
    if not releases:
        tell("There are no weights in this build. Train some with `dnf-pyg fit`.")
    for release in releases:
        tell(*release_lines(release))
    damaged = [release.name for release in releases if not release.intact]
    if damaged:
        raise WeightsError(
            f"Expected weights with the sha256 of their card (got others: {', '.join(damaged)}). Install them again."
        )


def release_lines(release: Release) -> list[str]:
    """Lines that describe released weights."""
    benchmark = release.metrics["benchmark"]
    facts = [
        "theta not measured"
        if benchmark is None
        else f"theta {benchmark['theta_deg']:.3f} degrees on {benchmark['data']}",
        f"{release.metrics['num_parameters']:,} parameters",
        f"licence {release.licence}",
        f"sha256 {release.metrics['sha256'][:12]} {'verified' if release.intact else 'WRONG'}",
    ]
    default = " (default)" if release.name == DEFAULT_WEIGHTS else ""
    return [f"{release.name}{default}", f"  {release.description}", f"  {', '.join(facts)}"]
