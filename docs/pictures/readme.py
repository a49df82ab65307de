"""Draw the picture of the README: `python docs/pictures/readme.py` writes docs/images/readme.png."""

import io
from pathlib import Path

import torch
import trimesh
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL import Image

import dnf_pyg
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.view import Camera, draw_faces, normal_error

TARGET = Path(__file__).parents[1] / "images" / "readme.png"
KIND, SEED, NUM_FACES, LEVEL = "gear", 1004, 12000, 0.2  # training has not seen it
WORST = 30.0  # degrees, end of the colour scale


def picture() -> Figure:
    """Noisy, denoised, and the errors of both."""
    pos, face = SHAPES[KIND](torch.Generator().manual_seed(SEED), NUM_FACES)
    noisy = GaussianNormalNoise()(pos, face, LEVEL, torch.Generator().manual_seed(0))
    denoised = dnf_pyg.denoise(trimesh.Trimesh(noisy.numpy(), face.t().numpy(), process=False)).pos
    errors = {name: normal_error(moved, pos, face) for name, moved in (("noisy", noisy), ("denoised", denoised))}
    camera = Camera.looking_at(pos)
    figure = Figure(figsize=(12.4, 3.4), dpi=100)
    axes = figure.subplots(1, 4, gridspec_kw={"left": 0, "right": 0.93, "wspace": 0.02, "bottom": 0, "top": 0.9})
    draw_faces(axes[0], noisy, face, camera=camera, size=500)
    draw_faces(axes[1], denoised, face, camera=camera, size=500)
    axes[0].set_title("noisy")
    axes[1].set_title("denoised")
    for axis, (name, moved) in zip(axes[2:], (("noisy", noisy), ("denoised", denoised)), strict=True):
        draw_faces(axis, moved, face, errors[name], colors="YlOrRd", limits=(0, WORST), camera=camera, size=500)
        axis.set_title(f"{name}: {errors[name].mean():.1f}° off")
    bar = figure.add_axes((0.945, 0.08, 0.012, 0.74))
    scale = ScalarMappable(Normalize(0, WORST), "YlOrRd")
    figure.colorbar(scale, cax=bar, extend="max", label="error of the facet normal (degrees)")
    return figure


if __name__ == "__main__":
    drawn = io.BytesIO()
    picture().savefig(drawn)
    Image.open(drawn).convert("RGB").quantize(128).save(TARGET, optimize=True)
