"""The result of :func:`dnf_pyg.denoise`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.io.inputs import save_mesh
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.mesh.noise_level import NoiseEstimate
from dnf_pyg.options import Direction

__all__ = ["DenoiseResult"]


@dataclass(frozen=True)
class DenoiseResult:
    """Result of :func:`~dnf_pyg.denoise`.

    Attributes:
        mesh: The denoised mesh, of the kind that was given (:class:`~dnf_pyg.io.files.MeshFile` for a path); all but
            its vertex positions is as in the input.
        pos: Its vertex positions, (V, 3) float64.
        face: Its triangles, (3, F).
        normal: Filtered facet normals, (F, 3), unit length, which the vertices were moved to fit.
        coverage: Number of patches that held each face, (F,).
        confidence: Agreement of these patches, (F,), up to 1.
        noise: Estimated noise of the input: its level, in mean edge lengths, and its correlation.
        flipped_before: Number of faces of the input more than 90 degrees from their filtered normal.
        flipped_after: Number of such faces of the result.
        seconds: Time by stage.
        warnings: Properties of the input or result that make it less reliable, a sentence each.
        num_iterations: Number of iterations of the vertex update that ran.
        ended_by: Why no more ran, half a sentence.
        noisy_pos: Vertex positions of the input, (V, 3) float64.
        left_alone: Share of the mesh that stays in place since the noise does not explain what would change there.
    """

    mesh: Any
    pos: Tensor
    face: Tensor
    normal: Tensor
    coverage: Tensor
    confidence: Tensor
    noise: NoiseEstimate
    flipped_before: int
    flipped_after: int
    seconds: dict[str, float]
    warnings: list[str]
    num_iterations: int
    ended_by: str
    noisy_pos: Tensor
    left_alone: float

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Vertex positions of the denoised mesh, (V, 3)."""
        return self.pos.numpy()

    @property
    def movement(self) -> Tensor:
        """Displacement of each vertex, (V,), in mean edge lengths of the input."""
        unit = mean_edge_length(self.noisy_pos, self.face).clamp(min=1e-300)
        return (self.pos - self.noisy_pos).norm(dim=1) / unit

    def save(self, path: str | Path) -> None:
        """Write the denoised mesh; the ending of the path decides the format.

        Raises:
            MeshFileError: If the format is unknown.
            OutputError: If the file cannot be written.
        """
        save_mesh(self.mesh, self.pos, self.face, path)

    def report(self, path: str | Path, title: str = "Denoised mesh", view: Direction = "auto") -> None:
        """Write a page with the mesh before and after in 3D, and figures. It opens in any browser.

        Args:
            path: Page to write.
            title: Its heading.
            view: Where the mesh is seen from at first, as :meth:`~dnf_pyg.view.Camera.choose` takes it.

        Raises:
            OutputError: If the page cannot be written.
            ValueError: If ``view`` is no direction.
        """
        from dnf_pyg.view import Camera, write_report  # take a while to import

        note = f"{self.face.size(1):,} triangles, {len(self.pos):,} vertices. " + " ".join(self.warnings)
        write_report(
            path, self.noisy_pos, self.pos, self.face, title=title, subtitle=note, figures=self.figures(),
            camera=Camera.choose((self.noisy_pos, self.face), (self.pos, self.face), view=view),
        )  # fmt: skip

    def figures(self) -> dict[str, tuple[str, ...]]:
        """Figures for readers: a value, or one before and one after, by name."""
        movement = self.movement
        return {
            "Faces folded over": (str(self.flipped_before), str(self.flipped_after)),
            "Noise level (estimate, mean edge lengths)": (f"{self.noise.level:.3f}",),
            "Correlation of the noise along edges (estimate)": (f"{self.noise.correlation:.2f}",),
            "Displacement, mean (mean edge lengths)": (f"{movement.mean():.3f}",),
            "Displacement, largest": (f"{movement.max():.3f}",),
            "Iterations of the vertex update": (f"{self.num_iterations}: {self.ended_by}",),
            "Patches per face": (f"{self.coverage.double().mean():.2f}",),
            "Agreement of overlapping patches": (f"{self.confidence.double().mean():.1%}",),
            "Time": (f"{sum(self.seconds.values()):.1f} s",),
        }
