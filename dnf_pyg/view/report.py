"""The pages that show a mesh before and after denoising, any meshes, and the pages of several meshes."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from urllib.parse import quote

import torch
from torch import Tensor

from dnf_pyg.io.atomic import write_bytes
from dnf_pyg.view.camera import Camera
from dnf_pyg.view.movement import scale_end, signed_movement
from dnf_pyg.view.page import Mode, Side, render_page, write_page
from dnf_pyg.view.pictures import normal_error

__all__ = ["write_index", "write_report", "write_view"]

_MOVED = "mean edge lengths, outwards is positive"


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
    moved = signed_movement(before, after, face)
    modes, values = {"moved": _movement_mode(moved)}, {"moved": (moved, moved)}
    if reference is not None:
        modes["error"] = Mode("Error", "degrees from the reference's facet normal", 0.0, 30.0, "YlOrRd")
        values["error"] = (normal_error(before, reference, face), normal_error(after, reference, face))
    sides = [
        Side(name, pos, face, {key: pair[number] for key, pair in values.items()})
        for number, (name, pos) in enumerate((("Before", before), ("After", after)))
    ]
    histograms = [_histogram(mode, *values[key]) for key, mode in modes.items()]
    write_page(
        path, sides, title=title, subtitle=subtitle, modes=modes, figures=figures, settings=settings,
        histograms=histograms, camera=camera,
    )  # fmt: skip


def write_view(
    path: str | Path, meshes: Mapping[str, tuple[Tensor, Tensor]], *, title: str, camera: Camera | None = None
) -> None:
    """Write one HTML page that shows meshes in 3D, side by side in one frame. It needs no network.

    Two meshes with the same faces are compared as :func:`write_report` does.

    Args:
        path: Page to write.
        meshes: Positions (V, 3) and faces (3, F) of each mesh by its name, from left to right.
        title: Heading of the page.
        camera: Where the meshes are seen from at first; by default :meth:`Camera.choose` decides.

    Raises:
        OutputError: If the page cannot be written.
        ValueError: If no mesh is given.
    """
    if not meshes:
        raise ValueError("Expected 'meshes' with at least one mesh (got none). Pass positions and faces by name.")
    figures = {name: (f"{face.size(1):,} triangles, {len(pos):,} vertices",) for name, (pos, face) in meshes.items()}
    modes, values, histograms = {}, {}, []
    (before, face), (after, other) = next(iter(meshes.values())), list(meshes.values())[-1]
    if len(meshes) == 2 and len(before) == len(after) and torch.equal(face, other):
        values["moved"] = signed_movement(before, after, face)
        modes["moved"] = _movement_mode(values["moved"])
        histograms.append(_histogram(modes["moved"], values["moved"], values["moved"]))
    sides = [Side(name, pos, face, values) for name, (pos, face) in meshes.items()]
    write_page(path, sides, title=title, modes=modes, figures=figures, histograms=histograms, camera=camera)


def write_index(path: str | Path, pages: Mapping[str, tuple[str, Sequence[str]]], columns: Sequence[str]) -> None:
    """Write a page with a row for each of several pages in the same folder.

    Args:
        path: Page to write.
        pages: File name of each page by the name to show, with the figures of its row.
        columns: Headings of the figures.

    Raises:
        OutputError: If the page cannot be written.
    """
    linked = {name: (quote(os.fsencode(file)), figures) for name, (file, figures) in pages.items()}
    write_bytes(Path(path), render_page("index", title="Denoised meshes", pages=linked, columns=columns))


def _movement_mode(moved: Tensor) -> Mode:
    end = scale_end(moved)
    return Mode("Movement", _MOVED, -end, end, "RdBu_r")


def _histogram(mode: Mode, before: Tensor, after: Tensor, num_bins: int = 60) -> dict[str, object]:
    """Heights of the bars relative to the highest, and labels, as the template takes them."""
    sides = {"before": ("before", before), "after": ("after", after)}
    if before is after:  # the movement between the two, which belongs to neither
        sides = {"after": ("all vertices", after)}
    counts = {key: torch.histc(value.float(), num_bins, mode.least, mode.most) for key, (_, value) in sides.items()}
    highest = max(float(count.max()) for count in counts.values()) or 1.0
    captions = {}
    for key, (name, value) in sides.items():
        mean = f"mean magnitude {value.abs().mean():.3g}" if mode.least else f"mean {value.mean():.3g}"
        beyond = float(((value > mode.most) | (value < mode.least)).double().mean())
        captions[key] = f"{name}: {mean}" + (f", {beyond:.1%} beyond {mode.most:.3g}" if beyond >= 5e-4 else "")
    return {
        "title": f"{mode.label} ({mode.unit})",
        "ticks": [f"{mode.least + (mode.most - mode.least) * i / 4:.3g}" for i in range(5)],
        "sides": {key: {"caption": captions[key], "heights": (counts[key] / highest).tolist()} for key in sides},
    }
