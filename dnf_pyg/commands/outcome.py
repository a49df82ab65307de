"""Figures of a denoised mesh: as numbers, as text, and as rows of the report page."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnf_pyg.commands.compare import measure
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import MeshFile
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.pipeline import DenoiseResult

__all__ = ["Outcome", "outcome_figures", "outcome_text"]


@dataclass(frozen=True)
class Outcome:
    """A denoised mesh and its figures.

    Attributes:
        mesh: The input.
        result: Its denoised version.
        output: File of the denoised version.
        seconds: Time from reading the input to writing the output.
        reference: The clean mesh, if it is known.
    """

    mesh: MeshFile
    result: DenoiseResult
    output: Path
    seconds: float
    reference: MeshFile | None

    def values(self) -> dict[str, Any]:
        """Figures as plain numbers."""
        mesh, result = self.mesh, self.result
        moved = result.movement
        values: dict[str, Any] = {
            "input": str(mesh.path),
            "output": str(self.output),
            "num_vertices": len(mesh.pos),
            "num_faces": mesh.face.size(1),
            "noise_level": result.noise.level,
            "noise_correlation": result.noise.correlation,
            "noise_is_correlated": result.noise.is_correlated,
            "mean_move": float(moved.mean()),
            "largest_move": float(moved.max()),
            "flipped_before": result.flipped_before,
            "flipped_after": result.flipped_after,
            "num_iterations": result.num_iterations,
            "ended_by": result.ended_by,
            "mean_coverage": float(result.coverage.double().mean()),
            "mean_confidence": float(result.confidence.double().mean()),
            "seconds": {**result.seconds, "total": self.seconds},
            "warnings": result.warnings,
        }
        if self.reference is not None:
            clean_normal = face_normals(self.reference.pos, self.reference.face)
            values["before"] = measure(mesh.pos, mesh.face, self.reference)
            values["after"] = measure(result.pos, mesh.face, self.reference)
            values["theta_of_normals"] = mean_angular_difference(result.normal, clean_normal)
        return values


def outcome_text(values: dict[str, Any]) -> list[str]:
    """Lines for the terminal, from :meth:`Outcome.values`."""
    lines = [
        f"{values['output']}: {values['num_faces']} faces in {values['seconds']['total']:.1f} s; in mean edge lengths, "
        f"noise level about {values['noise_level']:.2f}, vertices moved by {values['mean_move']:.2f} on average",
        f"vertex update of {values['num_iterations']} iterations: {values['ended_by']}",
    ]
    if values["noise_is_correlated"]:
        lines.append(
            f"the noise is alike at neighbouring vertices (correlation about {values['noise_correlation']:.2f}), so "
            "defaults for scans apply; --num_coarser 0 --smoothing 0.15 --early_stopping always comes close to those "
            "for independent noise"
        )
    if "before" in values:
        lines += [
            f"theta of the noisy mesh        {values['before']['theta']:7.3f} degrees",
            f"theta of the filtered normals  {values['theta_of_normals']:7.3f} degrees",
            f"theta of the denoised mesh     {values['after']['theta']:7.3f} degrees",
        ]
    return lines


def outcome_figures(values: dict[str, Any], result: DenoiseResult) -> dict[str, tuple[str, ...]]:
    """Rows for the page, from :meth:`Outcome.values`."""
    rows: dict[str, tuple[str, ...]] = {}
    if "before" in values:
        before, after = values["before"], values["after"]
        rows["Mean angle to the clean facet normals θ"] = (f"{before['theta']:.2f}°", f"{after['theta']:.2f}°")
        rows["Vertex error Eᵥ (mean edge lengths)"] = tuple(f"{side['vertex_error']:.3f}" for side in (before, after))
        for angle in (5, 10):
            rows[f"Faces within {angle}°"] = tuple(f"{side[f'within_{angle}_degrees']:.1%}" for side in (before, after))
    return rows | result.figures() | {"Time": (f"{values['seconds']['total']:.1f} s",)}
