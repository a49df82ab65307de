"""Cost of the classical filters and of E_v by number of faces, processor seconds of one thread."""

import statistics
import time
from functools import partial

import torch
import trimesh

from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.mesh.surface_distance import surface_distance


def median(function, repeats=3):
    """Median processor seconds of a call, after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return statistics.median(times)


def main():
    torch.set_num_threads(1)
    print("   faces " + " ".join(f"{name:>10}" for name in [*BASELINES, "E_v", "by trimesh"]))
    for subdivisions in (4, 5, 6):
        clean = trimesh.creation.icosphere(subdivisions=subdivisions)
        pos, face = torch.tensor(clean.vertices), torch.tensor(clean.faces).t().contiguous()
        noisy = GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0))
        calls = [partial(make(), noisy, face) for make in BASELINES.values()]
        calls.append(partial(surface_distance, noisy, pos, face))
        calls.append(partial(trimesh.proximity.closest_point, clean, noisy.numpy()))
        print(f"{face.size(1):8} " + " ".join(f"{median(call):10.2f}" for call in calls), flush=True)


if __name__ == "__main__":
    main()
