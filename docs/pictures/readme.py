"""Draw the picture of the README: `python docs/pictures/readme.py` writes docs/images/readme.png."""

import trimesh
from few_colors import save
from matplotlib.figure import Figure

import dnf_pyg
from dnf_pyg.commands.demo import noisy_part, noisy_scan
from dnf_pyg.view import Camera, draw_faces, normal_error

NUM_FACES = 12000  # as `dnf-pyg demo` makes; training has not seen these meshes


def picture() -> Figure:
    """A scan and a part, each noisy and denoised."""
    figure = Figure(figsize=(13, 3.5), dpi=100)
    axes = iter(figure.subplots(1, 4, gridspec_kw={"left": 0, "right": 1, "wspace": 0.02, "bottom": 0, "top": 0.9}))
    for name, make in (("scan", noisy_scan), ("part", noisy_part)):
        clean, noisy, face = make(NUM_FACES)
        denoised = dnf_pyg.denoise(trimesh.Trimesh(noisy.numpy(), face.t().numpy(), process=False)).pos
        camera = Camera.choose((clean, face))
        for state, pos in (("noisy", noisy), ("denoised", denoised)):
            axis = next(axes)
            draw_faces(axis, pos, face, camera=camera, size=500)
            axis.set_title(f"{name}, {state}: {normal_error(pos, clean, face).mean():.1f}° off", fontsize=15)
    return figure


if __name__ == "__main__":
    save(picture(), "readme")
