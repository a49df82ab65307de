"""Theta of decimated statues of the benchmark before and after denoising, without noise and with noise of 0.1.

``python tests/bench/measure_statues.py DATA/cnr/Synthetic``
"""

import sys
import warnings
from pathlib import Path

import torch

from dnf_pyg import denoise
from dnf_pyg.errors import DenoiseWarning
from dnf_pyg.evaluate.benchmark.tables import markdown_table
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import face_normals
from dnf_pyg.mesh.coarse import coarsen
from dnf_pyg.mesh.noise import GaussianNormalNoise


def measure(pos, face, level):
    """Cells of the table for one statue and one level of noise."""
    noisy = GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(1))
    result = denoise((noisy, face.t()), "best")
    clean = face_normals(pos, face)
    before, after = (mean_angular_difference(face_normals(where, face), clean) for where in (noisy, result.pos))
    estimate = (f"{result.noise.level:.2f}", f"{result.noise.correlation:.2f}")
    return [f"{level}", *estimate, f"{before:.1f}", f"{after:.1f}", f"{result.left_alone:.0%}"]


def main(data):
    warnings.simplefilter("ignore", DenoiseWarning)
    rows = []
    for name in ("chinese_lion", "bunny_hi"):
        mesh = read_mesh(data / "test" / "original" / f"{name}.obj")
        for num_faces in (2000, 3000):
            coarse = coarsen(mesh.pos, mesh.face, num_faces / mesh.face.size(1))
            rows += [[name, str(coarse.face.size(1)), *measure(coarse.pos, coarse.face, level)] for level in (0.0, 0.1)]
    print(markdown_table(["mesh", "faces", "noise", "level", "correlation", "noisy", "denoised", "left alone"], rows))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
