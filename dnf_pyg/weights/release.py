"""Released weights: a folder with the network, its model card, its metrics and checksums."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from huggingface_hub import ModelCard, ModelCardData

from dnf_pyg.errors import WeightsError

if TYPE_CHECKING:  # so that releases are listed without torch
    from dnf_pyg.nn import Cascade, FilteringNetwork

__all__ = ["Release", "fingerprint", "packaged_releases", "read_release", "write_release"]

_FOLDER = Path(__file__).parent  # of the packaged weights
_CARD = """\
---
{data}
---

# {name}

{description}

{num_parameters:,} parameters; {num_bytes:,} bytes; input: facet normals of a patch and its {k} nearest faces per face.

```python
import dnf_pyg
import trimesh

result = dnf_pyg.denoise(trimesh.load("noisy.ply", process=False), weights="{name}")
```

## Training data and credits

{sources}

## Recipe

{recipe}

## Measured

{measured}

## Files

- `model.safetensors` sha256 `{sha256}`
- weights and configuration together: fingerprint `{fingerprint}`
"""


@dataclass(frozen=True)
class Release:
    """A folder of released weights as read.

    Attributes:
        name: Name of the folder.
        description: First paragraph of the model card.
        licence: Licence of the weights.
        metrics: Content of ``metrics.json``.
        intact: Whether the weights are the ones that the metrics were written for.
    """

    name: str
    description: str
    licence: str
    metrics: dict[str, Any]
    intact: bool


def fingerprint(net: "FilteringNetwork | Cascade") -> str:
    """Compute 12 hex digits that identify the weights and arguments of networks, whatever file they are in.

    A cascade of one has the fingerprint of its network. Arguments at their default do not enter, so an argument that is
    added later leaves old fingerprints as they are.
    """
    first, *later = net.networks
    if later:
        return hashlib.sha256("".join(map(fingerprint, net.networks)).encode()).hexdigest()[:12]
    default = {key: json.dumps(entry.default) for key, entry in inspect.signature(type(first)).parameters.items()}
    config = {key: value for key, value in first.arguments.items() if json.dumps(value) != default[key]}
    digest = hashlib.sha256(type(first).__name__.encode() + json.dumps(config, sort_keys=True).encode())
    for name, value in sorted(first.state_dict().items()):
        digest.update(name.encode() + value.cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()[:12]


def write_release(
    folder: Path,
    net: "FilteringNetwork | Cascade",
    *,
    description: str,
    licence: str,
    sources: str,
    recipe: str,
    benchmark: Mapping[str, Any] | None = None,
) -> Release:
    """Write weights as safetensors with ``config.json`` and a model card (``README.md``).

    ``metrics.json`` beside them holds checksums and what was measured.

    Args:
        folder: Where to write; its name is that of the weights. Files of an earlier release are replaced.
        net: The network, or the networks of a cascade.
        description: What these weights are for, a paragraph.
        licence: Licence of the weights, an SPDX identifier.
        sources: Training data with licences and credits, markdown.
        recipe: How to train them again, markdown.
        benchmark: Means measured with exactly these weights, see :func:`dnf_pyg.evaluate.benchmark.summarize`.

    Returns:
        The release, read back from the folder.

    Raises:
        WeightsError: If the folder cannot be written.
    """
    try:
        net.save_pretrained(folder)
        weights = (folder / "model.safetensors").read_bytes()
        metrics = {
            "fingerprint": fingerprint(net),
            "sha256": hashlib.sha256(weights).hexdigest(),
            "num_parameters": sum(parameter.numel() for parameter in net.parameters()),
            "benchmark": None if benchmark is None else dict(benchmark),
        }
        card = _CARD.format(
            data=ModelCardData(license=licence.lower(), library_name="dnf_pyg", tags=["mesh-denoising"]).to_yaml(),
            name=folder.name,
            description=description.strip(),
            num_bytes=len(weights),
            k=max(max(part.k) for part in net.networks),
            sources=sources.strip(),
            recipe=recipe.strip(),
            measured=_measured(benchmark),
            **{key: metrics[key] for key in ("num_parameters", "sha256", "fingerprint")},
        )
        (folder / "metrics.json").write_text(json.dumps(metrics, indent=1) + "\n")
        (folder / "README.md").write_text(card)
    except OSError as error:
        raise WeightsError(
            f"Expected a folder that can be written (got '{folder}': {error.strerror}). Choose another one."
        ) from error
    return read_release(folder)


def read_release(folder: Path) -> Release:
    """Read what a folder says about its weights, and check it against them.

    Raises:
        WeightsError: If the model card or the metrics are missing or damaged.
    """
    try:
        card = ModelCard.load(folder / "README.md", ignore_metadata_errors=False)
        metrics = json.loads((folder / "metrics.json").read_text())
        weights = (folder / "model.safetensors").read_bytes()
        paragraphs = [part for part in card.text.strip().split("\n\n") if not part.startswith("#")]
        return Release(
            name=folder.name,
            description=" ".join(paragraphs[0].split()),
            licence=str(card.data.license or "not stated"),
            metrics=metrics,
            intact=hashlib.sha256(weights).hexdigest() == metrics["sha256"],
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise WeightsError(f"Expected released weights (got '{folder}': {error}). Export them again.") from error


def packaged_releases() -> list[Release]:
    """Read all weights that the package carries, by name.

    Raises:
        WeightsError: See :func:`read_release`.
    """
    return [read_release(card.parent) for card in sorted(_FOLDER.glob("*/README.md"))]


def _measured(benchmark: Mapping[str, Any] | None) -> str:
    """Metrics of the card, markdown."""
    if benchmark is None:
        return "Not measured."
    lines = [
        f"On {benchmark['data']}, {benchmark['num_meshes']} noisy meshes, {benchmark['parameters']}. θ: mean angle to "
        "the clean facet normals in degrees; E_v: mean distance to the clean surface in mean edge lengths.",
        "",
        "| θ of the mesh | θ of the normals | E_v |",
        "| ---: | ---: | ---: |",
        f"| {benchmark['theta_deg']:.3f} | {benchmark['theta_normals_deg']:.3f} | {benchmark['vertex_error']:.4f} |",
        "",
        "| mesh | θ, mean of the noise levels |",
        "| --- | ---: |",
        *(f"| {mesh} | {theta:.3f} |" for mesh, theta in benchmark["theta_by_mesh"].items()),
    ]
    return "\n".join(lines)
