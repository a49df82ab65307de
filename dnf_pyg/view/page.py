"""The HTML page that shows meshes in 3D. It needs no network, and holds everything that it shows."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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
from dnf_pyg.mesh.geometry import vertex_normals
from dnf_pyg.mesh.weld import weld
from dnf_pyg.view.camera import Camera

__all__ = ["Mode", "Side", "render_page", "write_page"]


@dataclass(frozen=True)
class Mode:
    """A way to colour meshes by values, and its scale.

    Attributes:
        label: Name of the button.
        unit: What the values are.
        least: Value at the lower end of the colours.
        most: Value at the upper end.
        colors: Name of a matplotlib colour map.
    """

    label: str
    unit: str
    least: float
    most: float
    colors: str


@dataclass(frozen=True)
class Side:
    """A mesh of the page.

    Attributes:
        name: Text above it.
        pos: Vertex positions, (V, 3).
        face: Vertices of each face, (3, F).
        values: Values by mode, (V,) or (F,).
    """

    name: str
    pos: Tensor
    face: Tensor
    values: Mapping[str, Tensor] = field(default_factory=dict)


def write_page(
    path: str | Path,
    sides: Sequence[Side],
    *,
    title: str,
    subtitle: str = "",
    modes: Mapping[str, Mode] = MappingProxyType({}),
    figures: Mapping[str, Sequence[str]] = MappingProxyType({}),
    settings: Mapping[str, object] = MappingProxyType({}),
    histograms: Sequence[Mapping[str, object]] = (),
    camera: Camera | None = None,
) -> None:
    """Write a page that shows meshes side by side, or two of them with a divider or in turn.

    Two meshes with the same faces get a slider between their positions, and a button that saves what it shows.

    Args:
        path: Page to write.
        sides: The meshes, from left to right.
        title: Heading of the page.
        subtitle: Line below it.
        modes: Ways to colour the meshes by their values.
        figures: Rows of the table: a name, then one value, or two for before and after.
        settings: Rows of a second table.
        histograms: What the template shows as histograms.
        camera: Where the meshes are seen from at first; by default :meth:`Camera.choose` decides.

    Raises:
        OutputError: If the page cannot be written.
    """
    camera = camera or Camera.choose(*((side.pos, side.face) for side in sides))
    page = render_page(
        "report",
        title=title,
        subtitle=subtitle,
        names=[side.name for side in sides],
        blends=_blends(sides),
        modes=modes,
        figures=figures,
        settings={name: (value,) for name, value in settings.items()},
        histograms=histograms,
        data=_view_data(sides, modes, camera),
    )
    write_bytes(Path(path), page)


def render_page(name: str, **values: object) -> bytes:
    """Fill a template of this package, with the style of all pages and, if there is one, the script of its name.

    Bytes of file names that are not UTF-8 are shown escaped.
    """
    folder = files("dnf_pyg.view")
    style, template = folder.joinpath("report.css").read_text("utf-8"), folder.joinpath(f"{name}.html")
    script = folder.joinpath(f"{name}.js")
    program = script.read_text("utf-8") if script.is_file() else ""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.from_string(template.read_text("utf-8")).render(
        **values,
        version=version("dnf-pyg"),
        style=Markup(style),
        style_hash=_content_hash(style),
        script=Markup(program),
        script_hash=_content_hash(program),
    )
    return page.encode(errors="backslashreplace")


def _blends(sides: Sequence[Side]) -> bool:
    """Whether there are two meshes with the same faces."""
    return len(sides) == 2 and torch.equal(sides[0].face, sides[1].face) and len(sides[0].pos) == len(sides[1].pos)


def _view_data(sides: Sequence[Side], modes: Mapping[str, Mode], camera: Camera) -> dict[str, object]:
    """Meshes and colours, as the script takes them."""
    blends, shown = _blends(sides), []
    for number, side in enumerate(sides):
        centered = (side.pos.double() - camera.center) / camera.radius
        values = {
            key: {"per_face": len(value) == side.face.size(1), "values": _base64(value.float().numpy())}
            for key, value in side.values.items()
        }
        shown.append(
            {
                "name": side.name,
                "face": None if blends and number else _base64(side.face.t().numpy().astype("<u4")),
                "pos": _base64(centered.float().numpy()),
                "normal": _base64((_smooth_normals(side.pos, side.face) * 32767).round().short().numpy()),
                "values": values,
            }
        )
    return {
        "sides": shown,
        "blends": blends,
        "center": camera.center.tolist(),
        "radius": camera.radius,
        "turn": camera.rotation.t().reshape(-1).tolist(),  # column by column, as WebGL takes matrices
        "modes": {key: _scale(mode) for key, mode in modes.items()},
    }


def _smooth_normals(pos: Tensor, face: Tensor) -> Tensor:
    """Unit normals at the vertices, (V, 3), equal at vertices in the same place."""
    where, joined, vertex_id = weld(pos.double(), face)
    return vertex_normals(where, joined)[vertex_id]


def _scale(mode: Mode) -> dict[str, object]:
    ramp = (mpl.colormaps[mode.colors](np.linspace(0, 1, 256)) * 255).round().astype(np.uint8)
    return {
        "least": mode.least,
        "most": mode.most,
        "least_text": f"≤ {mode.least:.3g}" if mode.least else "0",
        "most_text": f"≥ {mode.most:.3g}",
        "unit": mode.unit,
        "colours": _base64(ramp),
    }


def _base64(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _content_hash(text: str) -> str:
    """Source expression by which the page's security policy allows this text and no other."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
