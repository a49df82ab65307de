"""The page that shows a mesh before and after denoising in 3D."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

import matplotlib as mpl
import numpy as np
import torch
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.view.camera import Camera
from dnf_pyg.view.pictures import normal_error

__all__ = ["write_report"]


@dataclass(frozen=True)
class _Mode:
    """A way to colour the 3D view: values of both sides, (V,) or (F,), and their scale from 0 to ``most``."""

    label: str
    unit: str
    most: float
    colors: str
    before: Tensor
    after: Tensor

    def scale(self, num_faces: int) -> dict[str, object]:
        """Colours and labels, as the script takes them."""
        ramp = (mpl.colormaps[self.colors](np.linspace(0, 1, 256)) * 255).round().astype(np.uint8)
        return {
            "per_face": len(self.after) == num_faces,
            "most": self.most,
            "most_text": f"{self.most:.3g}",
            "unit": self.unit,
            "colours": _base64(ramp),
        }

    def histogram(self, num_bins: int = 60) -> dict[str, object]:
        """Heights of the bars relative to the highest, and labels, as the template takes them."""
        sides = {"before": ("before", self.before), "after": ("after", self.after)}
        if self.before is self.after:  # the movement between the two, which belongs to neither
            sides = {"after": ("all vertices", self.after)}
        counts = {key: torch.histc(value.float(), num_bins, 0, self.most) for key, (_, value) in sides.items()}
        highest = max(float(count.max()) for count in counts.values()) or 1.0
        captions = {}
        for key, (name, value) in sides.items():
            beyond = float((value > self.most).double().mean())
            captions[key] = f"{name}: mean {value.mean():.3g}" + (
                f", {beyond:.1%} beyond {self.most:.3g}" if beyond >= 5e-4 else ""
            )
        return {
            "title": f"{self.label} ({self.unit})",
            "ticks": [f"{self.most * i / 4:.3g}" for i in range(5)],
            "sides": {key: {"caption": captions[key], "heights": (counts[key] / highest).tolist()} for key in sides},
        }


def write_report(
    path: str | Path,
    before: Tensor,
    after: Tensor,
    face: Tensor,
    *,
    title: str,
    subtitle: str = "",
    reference: Tensor | None = None,
    figures: Mapping[str, Sequence[str]] = MappingProxyType({}),
    settings: Mapping[str, object] = MappingProxyType({}),
    camera: Camera | None = None,
) -> None:
    """Write one HTML page with both meshes in 3D, histograms, figures and settings. It needs no network.

    Args:
        path: Page to write.
        before: Vertex positions of the noisy mesh, (V, 3).
        after: Vertex positions of the denoised mesh, (V, 3).
        face: Vertices of each face, (3, F).
        title: Heading of the page.
        subtitle: Line below it.
        reference: Vertex positions of the clean mesh, (V, 3), to colour faces by their error.
        figures: Rows of the table: a name, then one value, or two for before and after.
        settings: Options that the mesh was denoised with.
        camera: Where the meshes are seen from at first; by default :meth:`Camera.choose` decides.

    Raises:
        OutputError: If the page cannot be written.
        ValueError: If the meshes have different numbers of vertices.
    """
    for name, pos in (("after", after), ("reference", reference)):
        if pos is not None and len(pos) != len(before):
            raise ValueError(f"Expected '{name}' with {len(before)} vertices (got {len(pos)}). Pass the same mesh.")
    modes = _modes(before, after, face, reference)
    camera = camera or Camera.choose((before, face), (after, face))
    style, script = (files("dnf_pyg.view").joinpath(f"report.{kind}").read_text("utf-8") for kind in ("css", "js"))
    template = files("dnf_pyg.view").joinpath("report.html").read_text("utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string(template).render(
        title=title,
        subtitle=subtitle,
        modes=modes,
        figures=figures,
        settings={name: (value,) for name, value in settings.items()},
        histograms=[mode.histogram() for mode in modes.values()],
        version=version("dnf-pyg"),
        data=_view_data(before, after, face, modes, camera),
        style=Markup(style),
        style_hash=_content_hash(style),
        script=Markup(script),
        script_hash=_content_hash(script),
    )
    write_bytes(Path(path), page.encode())


def _modes(before: Tensor, after: Tensor, face: Tensor, reference: Tensor | None) -> dict[str, _Mode]:
    moved = (after - before).double().norm(dim=-1) / mean_edge_length(before, face).clamp(min=1e-300)
    modes = {"moved": _Mode("Displacement", "mean edge lengths", _rounded_up(moved), "viridis", moved, moved)}
    if reference is not None:
        errors = [normal_error(pos, reference, face) for pos in (before, after)]
        modes["error"] = _Mode("Error", "degrees from the reference's facet normal", 30.0, "YlOrRd", *errors)
    return modes


def _rounded_up(values: Tensor) -> float:
    """Upper end of a scale that 99% of the values lie below: 1, 2, 4 or 8 times a power of ten."""
    end = float(np.quantile(values.numpy(), 0.99)) if len(values) else 0.0
    if end <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(end))
    return float(next(step for step in (1, 2, 4, 8, 10) if step * power >= end) * power)


def _view_data(
    before: Tensor, after: Tensor, face: Tensor, modes: Mapping[str, _Mode], camera: Camera
) -> dict[str, object]:
    """Meshes and colours, as the script takes them."""
    sides = []
    for name, pos in (("before", before), ("after", after)):
        centered = (pos.double() - camera.center) / camera.radius
        values = {key: _base64(getattr(mode, name).float().numpy()) for key, mode in modes.items()}
        sides.append({"pos": _base64(centered.float().numpy()), "values": values})
    return {
        "face": _base64(face.t().numpy().astype("<u4")),
        "sides": sides,
        "turn": camera.rotation.t().reshape(-1).tolist(),  # column by column, as WebGL takes matrices
        "modes": {key: mode.scale(face.size(1)) for key, mode in modes.items()},
    }


def _base64(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _content_hash(text: str) -> str:
    """Source expression by which the page's security policy allows this text and no other."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
