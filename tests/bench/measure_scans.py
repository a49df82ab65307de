"""Theta of real scans before and after denoising, with the defaults, beside the classical filters.

``python tests/bench/measure_scans.py FOLDER [WEIGHTS ...]`` reads the pairs of a folder, one ``NAME.npz`` each with
``faces`` (F, 3), the true vertices ``gt`` (V, 3) and the noisy ones ``k1`` (V, 3).
"""

import sys
import time
import warnings
from pathlib import Path

import numpy as np
import torch

from dnf_pyg import FilterOptions, denoise
from dnf_pyg.errors import DenoiseWarning
from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.mesh.geometry import face_normals


def measure(path, weights):
    pair = np.load(path)
    face = torch.from_numpy(pair["faces"]).t().long()
    noisy, true = (torch.from_numpy(pair[name]).double() for name in ("k1", "gt"))
    normal = face_normals(true, face)

    def theta(pos):
        return mean_angular_difference(face_normals(pos, face), normal)

    row = {"faces": face.size(1), "noisy": theta(noisy)}
    for name, make in BASELINES.items():
        row[name] = theta(make()(noisy, face).pos)
    for name in weights:
        start = time.perf_counter()
        result = denoise((noisy, face.t()), name)
        seconds = time.perf_counter() - start
        single = denoise((noisy, face.t()), name, filtering=FilterOptions(num_coarser=0))
        row |= {f"{name}, no coarser version": theta(single.pos), name: theta(result.pos)}
        row |= {"level": result.noise.level, "correlation": result.noise.correlation}
        row |= {"left alone": result.left_alone, "seconds": seconds}
    return row


def main(folder, weights):
    warnings.simplefilter("ignore", DenoiseWarning)
    rows = {}
    for path in sorted(Path(folder).glob("*.npz")):
        if "gt" in np.load(path).files:
            rows[path.stem] = row = measure(path, weights)
            if len(rows) == 1:
                print("| |", " | ".join(row), "|\n| --- |", "---: | " * len(row))
            print(f"| {path.stem} |", " | ".join(f"{value:.5g}" for value in row.values()), "|", flush=True)
    for prefix in ("ycb_", ""):
        chosen = [list(row.values()) for name, row in rows.items() if name.startswith(prefix)]
        print(f"| mean of {len(chosen)} |", " | ".join(f"{value:.5g}" for value in np.mean(chosen, axis=0)), "|")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:] or ["best"])
