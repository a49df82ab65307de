"""List the weights that come along, or publish new ones: `dnf-pyg weights export CHECKPOINT -o FOLDER`."""

import argparse
import sys
from pathlib import Path
from typing import Any

from dnf_pyg.errors import DataError, WeightsError
from dnf_pyg.evaluate.benchmark import read_results, summarize
from dnf_pyg.weights import DEFAULT_WEIGHTS, load_network, packaged_weights
from dnf_pyg.weights.release import Release, fingerprint, read_release, write_release

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    export = parser.add_subparsers(metavar="ACTION").add_parser(
        "export",
        help="write a checkpoint as a folder to be released",
        description="Write safetensors, config.json, model card (README.md) and metrics.json with sha256.",
    )
    export.add_argument("checkpoint", metavar="CHECKPOINT", help="checkpoint of `dnf-pyg fit`, folder or packaged name")
    export.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER", help="its name is the weights'")
    export.add_argument("--description", required=True, metavar="TEXT", help="what the weights are for, a paragraph")
    export.add_argument("--licence", default="MIT", help="SPDX identifier (%(default)s)")
    export.add_argument("--sources", type=Path, required=True, metavar="MD", help="training data, licences, credits")
    export.add_argument("--recipe", type=Path, required=True, metavar="YAML_OR_MD", help="config or text: how trained")
    export.add_argument(
        "--benchmark", type=Path, metavar="JSON", help="results.json of `dnf-pyg benchmark` with these very weights"
    )
    export.set_defaults(run=_export)


def run(options: argparse.Namespace) -> None:
    """Print name, description, theta, licence and checksum of all packaged weights.

    Raises:
        WeightsError: If weights lack their card or are not those that the card speaks of.
    """
    folders = packaged_weights()
    if not folders:
        sys.stdout.write("no weights in this build: train some with `dnf-pyg fit`\n")
    releases = [read_release(folder) for folder in folders.values()]
    for release in releases:
        sys.stdout.write(_lines(release))
    damaged = [release.name for release in releases if not release.intact]
    if damaged:
        raise WeightsError(
            f"Expected weights with the sha256 of their card (got others: {', '.join(damaged)}): install them again"
        )


def _lines(release: Release) -> str:
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
    return f"{release.name}{default}\n  {release.description}\n  {', '.join(facts)}\n"


def _export(options: argparse.Namespace) -> None:
    net = load_network(options.checkpoint)
    benchmark = None if options.benchmark is None else _measured(options.benchmark, fingerprint(net))
    recipe = _text(options.recipe)
    release = write_release(
        options.output,
        net,
        description=options.description,
        licence=options.licence,
        sources=_text(options.sources),
        recipe=f"```yaml\n{recipe}```\n" if options.recipe.suffix in (".yaml", ".yml") else recipe,
        benchmark=benchmark,
    )
    sys.stdout.write(_lines(release))


def _measured(path: Path, weights: str) -> dict[str, Any]:
    """Means over the rows that were measured with the weights of this fingerprint."""
    results, data = read_results(path)
    rows = [row for row in results if f"weights={weights}," in row.parameters]
    if not rows:
        raise WeightsError(f"Expected results of the weights {weights} in '{path}' (got none): benchmark them first")
    return summarize([row for row in rows if row.method == rows[0].method], data)


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"Expected a text file (got '{path}': {error}): check the path") from error
