"""Draw real scans: `python docs/pictures/scans.py DATA/real` writes docs/images/scan_*.png and scan_correlation.png."""

import sys
import warnings
from pathlib import Path

import numpy as np
import torch
from few_colors import save
from matplotlib.figure import Figure
from torch import Tensor

import dnf_pyg
from dnf_pyg.mesh.correlation import correlation_by_ring
from dnf_pyg.mesh.geometry import vertex_normals
from dnf_pyg.mesh.noise import CorrelatedNoise, GaussianNormalNoise
from dnf_pyg.view import Camera, draw_faces, normal_error

RINGS = 8


def read(path: Path) -> tuple[Tensor, Tensor, Tensor | None]:
    """Noisy vertices, faces and, where it is known, the true vertices."""
    data = np.load(path)
    noisy = torch.from_numpy(data["k1" if "k1" in data.files else "noisy"]).double()
    true = torch.from_numpy(data["gt"]).double() if "gt" in data.files else None
    return noisy, torch.from_numpy(data["faces"]).t().long(), true


def before_and_after(path: Path) -> Figure:
    """A scan, the scan denoised and, where it is known, the true surface."""
    noisy, face, true = read(path)
    meshes = {"scan": noisy, "denoised": dnf_pyg.denoise((noisy, face.t())).pos}
    camera = Camera.choose((noisy if true is None else true, face))
    if true is not None:
        meshes["true"] = true
    figure = Figure(figsize=(4.2 * len(meshes), 4.2), dpi=90)
    axes = figure.subplots(1, len(meshes), gridspec_kw={"left": 0, "right": 1, "wspace": 0.02, "bottom": 0, "top": 0.9})
    for axis, (state, pos) in zip(axes, meshes.items(), strict=True):
        draw_faces(axis, pos, face, camera=camera, size=500)
        known = true is not None and state != "true"
        axis.set_title(f"{state}: {normal_error(pos, true, face).mean():.1f}° off" if known else state, fontsize=14)
    return figure


def correlations(folder: Path) -> Figure:
    """Correlation of the errors by ring: real scans and noise models."""
    figure = Figure(figsize=(7, 4), dpi=100, layout="constrained")
    axis = figure.subplots()
    pairs = ("kinect_v1_pyramid_16", "print_nut", "ycb_foam_brick")
    for name in pairs:
        noisy, face, true = read(folder / f"{name}.npz")
        error = ((noisy - true) * vertex_normals(true, face)).sum(dim=1)
        axis.plot(range(1, RINGS + 1), correlation_by_ring(error, face, RINGS), marker="o", label=name)
    _, face, true = read(folder / f"{pairs[0]}.npz")
    for noise, style in ((GaussianNormalNoise(), ":"), (CorrelatedNoise(), "--")):
        moved = noise(true, face, 0.3, torch.Generator().manual_seed(0))
        error = ((moved - true) * vertex_normals(true, face)).sum(dim=1)
        axis.plot(
            range(1, RINGS + 1),
            correlation_by_ring(error, face, RINGS),
            style,
            color="grey",
            label=type(noise).__name__,
        )
    axis.set(xlabel="distance, edges", ylabel="correlation of the errors")
    axis.legend()
    return figure


if __name__ == "__main__":
    warnings.simplefilter("ignore", dnf_pyg.DenoiseWarning)
    folder = Path(sys.argv[1])
    for scan in ("kinect_v1_pyramid_16", "print_nut", "sfm_owl", "sfm_bird_bath"):
        save(before_and_after(folder / f"{scan}.npz"), f"scan_{scan}")
    save(correlations(folder), "scan_correlation")
