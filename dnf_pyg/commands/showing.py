"""Pictures and pages of denoised meshes."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from dnf_pyg.commands.options import DenoiseOptions
from dnf_pyg.commands.outcome import Outcome, outcome_figures
from dnf_pyg.view import Camera, draw_meshes, write_index, write_report

__all__ = ["index_outcomes", "show_outcome"]


def show_outcome(outcome: Outcome, values: dict[str, Any], options: DenoiseOptions, page: Path | None) -> None:
    """Write the picture and the page of a mesh, if they are asked for.

    Args:
        outcome: The denoised mesh.
        values: Its figures, from :meth:`Outcome.values`.
        options: How it was denoised; ``picture`` is the file of the picture.
        page: File of the page.
    """
    mesh, result, reference = outcome.mesh, outcome.result, outcome.reference
    if options.picture is not None:
        meshes = {} if reference is None else {"clean": (reference.pos, reference.face)}
        meshes |= {"noisy": (mesh.pos, mesh.face), "denoised": (result.pos, mesh.face)}
        camera = Camera.choose(*meshes.values(), view=options.view)
        draw_meshes(options.picture, meshes, meshes.get("clean"), moved=("noisy", "denoised"), camera=camera)
    if page is not None:
        write_report(
            page,
            mesh.pos,
            result.pos,
            mesh.face,
            title=f"{mesh.path.name}, denoised",
            subtitle=f"{mesh.face.size(1):,} triangles, {len(mesh.pos):,} vertices. " + " ".join(result.warnings),
            reference=reference.pos if reference is not None and torch.equal(reference.face, mesh.face) else None,
            figures=outcome_figures(values, result),
            settings=_settings(options),
            camera=Camera.choose((mesh.pos, mesh.face), (result.pos, mesh.face), view=options.view),
        )


def index_outcomes(index: Path, values: Mapping[str, dict[str, Any]]) -> None:
    """Write a page that lists those of several meshes, NAME.html beside it.

    Args:
        index: File to write.
        values: Figures of each mesh, from :meth:`Outcome.values`, by name.
    """
    rows = {name: (f"{name}.html", _row(figures)) for name, figures in values.items()}
    write_index(index, rows, ("Faces", "Noise level", "Mean movement", "Folded before", "Folded after"))


def _row(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Figures of a mesh for the page of several."""
    lengths = (f"{values[name]:.3f}" for name in ("noise_level", "mean_move"))
    return (f"{values['num_faces']:,}", *lengths, str(values["flipped_before"]), str(values["flipped_after"]))


def _settings(options: DenoiseOptions) -> dict[str, str]:
    """All options that decide the result, for the page."""
    values = {
        "weights": options.weights,
        "data_set": options.data_set or "none",
        "num_passes": options.num_passes,
        "mask": options.mask or "none",
    }
    values |= dataclasses.asdict(options.update) | dataclasses.asdict(options.filtering)
    named = {"None": "auto", "inf": "none", "True": "yes", "False": "no"}
    return {name.replace("_", " "): named.get(str(value), str(value)) for name, value in values.items()}
