"""Theta of decimated statues of the benchmark before and after denoising, without noise and with noise of 0.1.

``python tests/bench/measure_statues.py``
"""

import warnings
from pathlib import Path

import torch

from dnf_pyg import denoise
from dnf_pyg.errors import DenoiseWarning
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import face_normals, mean_edge_length, vertex_normals
from dnf_pyg.mesh.coarse import coarsen

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "cnr" / "Synthetic" / "test" / "original"


def main():
    warnings.simplefilter("ignore", DenoiseWarning)
    print("| mesh | faces | noise | level | correlation | noisy | denoised | left alone |\n" + "| --- " * 8 + "|")
    for name in ("chinese_lion", "bunny_hi"):
        mesh = read_mesh(FOLDER / f"{name}.obj")
        for num_faces in (2000, 3000):
            coarse = coarsen(mesh.pos, mesh.face, num_faces / mesh.face.size(1))
            pos, face = coarse.pos.double(), coarse.face
            for share in (0.0, 0.1):
                noise = torch.randn(len(pos), 1, generator=torch.Generator().manual_seed(1), dtype=pos.dtype)
                noisy = pos + share * mean_edge_length(pos, face) * noise * vertex_normals(pos, face)
                result = denoise((noisy, face.t()), "best")
                before, after = (
                    mean_angular_difference(face_normals(where, face), face_normals(pos, face))
                    for where in (noisy, result.pos)
                )
                print(
                    f"| {name} | {face.size(1)} | {share} | {result.noise.level:.2f} | {result.noise.correlation:.2f} "
                    f"| {before:.1f} | {after:.1f} | {result.left_alone:.0%} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
