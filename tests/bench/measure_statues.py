"""Theta of decimated meshes before and after denoising, without noise and with noise of 0.03 and 0.1.

``python tests/bench/measure_statues.py DATA/cnr/Synthetic`` takes every clean mesh of the benchmark, decimated to
2,000, 5,000 and 12,000 faces, and prints each result and a summary.
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

SIZES = (2000, 5000, 12000)
LEVELS = (0.0, 0.03, 0.1)
WORSE = 0.3  # degrees that count as harm


def measure(pos, face, level):
    """Estimate, theta before and after, and share of the mesh left alone."""
    noisy = GaussianNormalNoise()(pos, face, level, torch.Generator().manual_seed(1)) if level else pos
    result = denoise((noisy, face.t()), "best")
    clean = face_normals(pos, face)
    before, after = (mean_angular_difference(face_normals(where, face), clean) for where in (noisy, result.pos))
    return result.noise, before, after, result.left_alone


def main(data):
    warnings.simplefilter("ignore", DenoiseWarning)
    rows, thetas = [], {}
    for path in sorted(data.glob("*/original/*.obj")):
        mesh = read_mesh(path)
        for size in (size for size in SIZES if size < mesh.face.size(1)):
            coarse = coarsen(mesh.pos, mesh.face, size / mesh.face.size(1))
            for level in LEVELS:
                noise, before, after, left_alone = measure(coarse.pos, coarse.face, level)
                thetas.setdefault((level, size), []).append((before, after, noise.is_correlated))
                cells = (f"{level}", f"{noise.level:.3f}", f"{before:.2f}", f"{after:.2f}", f"{left_alone:.0%}")
                rows.append([path.stem, str(coarse.face.size(1)), *cells])
                print(*rows[-1], file=sys.stderr, flush=True)
    print(markdown_table(["mesh", "faces", "noise", "estimate", "noisy", "denoised", "left alone"], rows))
    summary = []
    for (level, size), pairs in sorted(thetas.items()):
        before, after, _ = torch.tensor(pairs).mean(dim=0).tolist()
        worse, scans = sum(last > first + WORSE for first, last, _ in pairs), sum(scan for _, _, scan in pairs)
        cells = (f"{before:.2f}", f"{after:.2f}", str(worse), str(scans))
        summary.append([f"{level}", str(size), str(len(pairs)), *cells])
    print(markdown_table(["noise", "faces", "meshes", "noisy", "denoised", "worse by 0.3", "read as scans"], summary))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
