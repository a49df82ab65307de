"""Pictures of denoised meshes, and the page that shows them in 3D."""

import base64
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

import matplotlib as mpl
import numpy as np
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.mesh.geometry import angular_difference, face_normals, mean_edge_length
from dnf_pyg.view.raster import Camera, render

__all__ = ["draw_meshes", "normal_error", "write_report"]

_COLORS = mpl.colormaps["YlOrRd"]


def normal_error(pos: Tensor, reference_pos: Tensor, face: Tensor) -> Tensor:
    """Angle between the facet normals of two meshes with the same faces, (F,), degrees.

    Examples:
        >>> flat = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        >>> upright = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
        >>> normal_error(flat, upright, torch.tensor([[0], [1], [2]])).round().tolist()
        [90.0]
    """
    return angular_difference(face_normals(pos.double(), face), face_normals(reference_pos.double(), face))


def draw_meshes(
    path: str | Path | BinaryIO,
    meshes: Mapping[str, tuple[Tensor, Tensor]],
    reference: tuple[Tensor, Tensor] | None = None,
    *,
    max_error: float = 30.0,
    size: int = 480,
    view: tuple[float, float, float] = (0.6, 0.5, 1.0),
) -> None:
    """Draw meshes side by side, and below them how far their facet normals are off.

    Args:
        path: Picture to write (png): a file, or a stream.
        meshes: Positions (V, 3) and faces (3, F) of each mesh by its title, from left to right.
        reference: Clean mesh; meshes with as many faces get an error map against it.
        max_error: Error at the end of the colour scale, degrees.
        size: Pixels per side of each mesh.
        view: Direction that the meshes are seen from; y is up.

    Raises:
        MeshFileError: If the picture cannot be written.
        ValueError: If no mesh is given.
    """
    if not meshes:
        raise ValueError("Expected 'meshes' with at least one mesh (got none)")
    camera = Camera.looking_at(torch.cat([pos for pos, _ in meshes.values()]), view)
    rows = 1 if reference is None else 2
    inch = size / 100
    figure = Figure(figsize=(inch * len(meshes) + (0.9 if reference else 0), (inch + 0.35) * rows), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, len(meshes), squeeze=False)
    figure.subplots_adjust(
        0.005, 0.005, 0.995 if reference is None else 1 - 0.85 / figure.get_figwidth(), 0.93, 0.01, 0.1
    )
    for column, (title, (pos, face)) in enumerate(meshes.items()):
        axes[0, column].imshow(render(pos, face, camera, size))
        axes[0, column].set_title(title)
        if reference is None or not torch.equal(reference[1], face):
            continue
        error = normal_error(pos, reference[0], face)
        color = torch.from_numpy(_COLORS((error / max_error).clamp(max=1).numpy())[:, :3])
        axes[1, column].imshow(render(pos, face, camera, size, color))
        axes[1, column].set_title(f"mean error {error.mean():.2f}°")
    for axis in axes.flat:
        axis.set_axis_off()
    if reference is not None:
        scale = ScalarMappable(Normalize(0, max_error), _COLORS)
        left = 1 - 0.75 / figure.get_figwidth()
        bar = figure.add_axes((left, 0.05, 0.2 / figure.get_figwidth(), 0.36))
        figure.colorbar(scale, cax=bar, extend="max", label="error of the facet normal (degrees)")
    picture = io.BytesIO()
    figure.savefig(picture)
    if isinstance(path, str | Path):
        write_bytes(Path(path), picture.getvalue())
    else:
        path.write(picture.getvalue())


@dataclass(frozen=True)
class _Mode:
    """A way to colour the 3D view: values of both sides, (V,) or (F,), and their scale."""

    label: str
    unit: str
    most: float
    colors: str
    before: Tensor
    after: Tensor

    def described(self, num_faces: int) -> dict[str, object]:
        ramp = (mpl.colormaps[self.colors](np.linspace(0, 1, 256)) * 255).round().astype(np.uint8)
        return {
            "per_face": len(self.after) == num_faces,
            "most": self.most,
            "most_text": f"{self.most:.3g}",
            "unit": self.unit,
            "colours": _base64(ramp),
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
) -> None:
    """Write one HTML page with both meshes in 3D, histograms, figures and settings; it needs no network.

    Args:
        path: Page to write.
        before: Vertex positions of the noisy mesh, (V, 3).
        after: Vertex positions of the denoised mesh, (V, 3).
        face: Vertices of each face, (3, F).
        title: Heading of the page.
        subtitle: Line below it.
        reference: Vertex positions of the clean mesh, (V, 3), for colours by error.
        figures: Rows of the table: a name, then one value, or two for before and after.
        settings: What the mesh was denoised with.

    Raises:
        MeshFileError: If the page cannot be written.
        ValueError: If the meshes have different numbers of vertices.
    """
    if any(len(pos) != len(before) for pos in (after, reference) if pos is not None):
        raise ValueError(f"Expected meshes of {len(before)} vertices (got {len(after)} after denoising)")
    modes = _modes(before, after, face, reference)
    page = files("dnf_pyg.view").joinpath("report.html").read_text(encoding="utf-8")
    content = {
        "title": escape(title),
        "subtitle": escape(subtitle),
        "modes": _mode_buttons(modes),
        "figures": _figure_table(figures),
        "settings": _figure_table({name: (str(value),) for name, value in settings.items()}),
        "histograms": "".join(_histogram(mode) for mode in modes.values()),
        "footer": f"Made by dnf-pyg {version('dnf-pyg')}. Everything that this page shows is inside it.",
        "data": json.dumps(_view_data(before, after, face, modes)).replace("<", "\\u003c"),
    }
    write_bytes(Path(path), re.sub(r"\{\{(\w+)\}\}", lambda found: content[found[1]], page).encode())


def _modes(before: Tensor, after: Tensor, face: Tensor, reference: Tensor | None) -> dict[str, _Mode]:
    moved = (after - before).double().norm(dim=-1) / mean_edge_length(before, face).clamp(min=1e-300)
    modes = {"moved": _Mode("Displacement", "mean edge lengths", _rounded_up(moved), "viridis", moved, moved)}
    if reference is not None:
        errors = [normal_error(pos, reference, face) for pos in (before, after)]
        modes["error"] = _Mode("Error", "degrees from the reference's facet normal", 30.0, "YlOrRd", *errors)
    return modes


def _rounded_up(values: Tensor) -> float:
    """End of a scale that 99% of the values lie below: 1, 2, 4 or 8 times a power of ten."""
    end = float(np.quantile(values.numpy(), 0.99)) if len(values) else 0.0
    if end <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(end))
    return float(next(step for step in (1, 2, 4, 8, 10) if step * power >= end) * power)


def _view_data(before: Tensor, after: Tensor, face: Tensor, modes: Mapping[str, _Mode]) -> dict[str, object]:
    camera = Camera.looking_at(torch.cat([before, after]))
    sides = []
    for name, pos in (("before", before), ("after", after)):
        centered = (pos.double() - camera.center) / camera.radius
        values = {key: _base64(getattr(mode, name).float().numpy()) for key, mode in modes.items()}
        sides.append({"pos": _base64(centered.float().numpy()), "values": values})
    return {
        "face": _base64(face.t().numpy().astype("<u4")),
        "sides": sides,
        "turn": camera.rotation.t().reshape(-1).tolist(),  # column by column, as WebGL has it
        "modes": {key: mode.described(face.size(1)) for key, mode in modes.items()},
    }


def _base64(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _mode_buttons(modes: Mapping[str, _Mode]) -> str:
    labels = {"shaded": "Shaded", **{key: mode.label for key, mode in modes.items()}}
    return "".join(f'<button data-mode="{key}" aria-pressed="false">{label}</button>' for key, label in labels.items())


def _figure_table(rows: Mapping[str, Sequence[str]]) -> str:
    width = max((len(values) for values in rows.values()), default=1)
    head = (
        "<thead><tr><th></th><th class=number>Before</th><th class=number>After</th></tr></thead>" if width > 1 else ""
    )
    body = ""
    for name, values in rows.items():
        cells = "".join(f"<td class=number>{escape(value)}</td>" for value in values[:-1])
        span = f" colspan={width + 1 - len(values)}" if len(values) < width else ""
        body += f"<tr><th>{escape(name)}</th>{cells}<td class=number{span}>{escape(values[-1])}</td></tr>"
    return f"<table>{head}<tbody>{body}</tbody></table>"


def _histogram(mode: _Mode, num_bins: int = 60) -> str:
    """Share of vertices or faces over the values of a mode, as a section with a drawing."""
    sides = {"before": mode.before, "after": mode.after}
    names = {"before": "before", "after": "after"}
    if mode.before is mode.after:  # the movement between the two, which belongs to neither
        sides, names = {"after": mode.after}, {"after": "all vertices"}
    counts = {key: torch.histc(value.float(), num_bins, 0, mode.most) for key, value in sides.items()}
    highest = max(float(count.max()) for count in counts.values()) or 1.0
    left, bottom, width, height = 8.0, 150.0, 404.0, 140.0
    drawing = ""
    for key, count in counts.items():
        tops = (bottom - height * count / highest).tolist()
        steps = " ".join(
            f"H{left + width * i / num_bins:.1f}V{top:.1f}H{left + width * (i + 1) / num_bins:.1f}"
            for i, top in enumerate(tops)
        )
        drawing += f'<path class="bars {key}" d="M{left} {bottom}{steps}V{bottom}Z"/>'
    for i in range(5):
        x, label, anchor = left + width * i / 4, f"{mode.most * i / 4:.3g}", "end" if i == 4 else "middle"
        drawing += f'<text x="{x:.0f}" y="166" text-anchor="{anchor}">{label}</text>'
    drawing += f'<path class="axis" d="M{left} {bottom}H{left + width}"/>'
    keys = ""
    for key, value in sides.items():
        beyond = float((value > mode.most).double().mean())
        more = f", {beyond:.1%} beyond {mode.most:.3g}" if beyond >= 5e-4 else ""
        told = f"{names[key]}: mean {value.mean():.3g}{more}"
        keys += f'<span class="key"><i style="background:var(--{key})"></i>{told}</span>'
    svg = f'<svg viewBox="0 0 420 172" role="img" aria-label="Histogram">{drawing}</svg>'
    return f"<section class=card><h2>{mode.label} ({mode.unit})</h2>{keys}{svg}</section>"
