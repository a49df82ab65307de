"""A first result: a noisy part and a noisy scan, made in code and denoised with the packaged weights."""

import torch
import trimesh
from torch import Tensor

from dnf_pyg.commands.denoise import run as denoise
from dnf_pyg.commands.options import DenoiseOptions
from dnf_pyg.commands.shape_options import DemoOptions
from dnf_pyg.commands.terminal import tell
from dnf_pyg.errors import OutputError
from dnf_pyg.io import write_mesh
from dnf_pyg.mesh.noise import GaussianNormalNoise, RayNoise
from dnf_pyg.synthetic.depth_image import depth_image_mesh
from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.synthetic.shapes.sized import sized_shape

__all__ = ["noisy_part", "noisy_scan", "run"]

Pair = tuple[Tensor, Tensor, Tensor]


def run(options: DemoOptions) -> None:
    """Make, denoise and show both meshes.

    Raises:
        OutputError: If the folder exists already, or cannot be written.
    """
    folder = options.output
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise OutputError(
            f"Expected a new folder (got '{folder}': {error.strerror}). Choose another with -o."
        ) from error
    for name, make in (("part", noisy_part), ("scan", noisy_scan)):
        tell(f"making a {name} of about {options.faces} faces, and adding noise ...")
        clean, noisy, face = make(options.faces)
        files = {kind: folder / f"{name}_{kind}.ply" for kind in ("clean", "noisy", "denoised")}
        for kind, pos in (("clean", clean), ("noisy", noisy)):
            write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, files[kind])
        picture, page = folder / f"{name}.png", folder / f"{name}.html"
        denoise(
            DenoiseOptions(
                (files["noisy"],), output=files["denoised"], reference=files["clean"], picture=picture, report=page
            )
        )
        tell(f"picture: {picture}", f"page in 3D: {page}", "")
    tell("Open the pages in a browser. Your own mesh: dnf-pyg denoise MESH --report report.html")


def noisy_part(num_faces: int) -> Pair:
    """Gear with sharp edges, as of a CAD program: clean and noisy vertex positions (V, 3), and faces (3, F)."""
    pos, face = sized_shape(SHAPES["gear"], 1004, num_faces)
    return pos, GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0)), face


def noisy_scan(num_faces: int) -> Pair:
    """What a scanner sees of a statue-like body from one side: clean and noisy positions (V, 3), and faces (3, F)."""
    pos, face = sized_shape(SHAPES["bumpy"], 1, max(20000, num_faces))
    num_pixels = 32
    for _ in range(4):  # faces grow with the square of the pixels
        seen, corners = depth_image_mesh(pos, face, num_pixels)
        num_pixels = max(2, round(num_pixels * (num_faces / corners.size(1)) ** 0.5))
    seen = seen * seen.new_tensor([1.0, 1.0, -1.0])
    corners = corners.flip(0)  # towards the viewer
    noisy = RayNoise([0.0], [1.0], camera=(0.5 * num_pixels, 0.5 * num_pixels, 4.0 * num_pixels))
    return seen, noisy(seen, corners, 0.3, torch.Generator().manual_seed(0)), corners
