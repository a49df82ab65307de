"""Denoise from file to file: seconds by stage, and peak memory. Arguments: mesh files; else spheres made in code."""

import resource
import sys
import tempfile
import time
from pathlib import Path

import torch
import trimesh

from dnf_pyg import denoise
from dnf_pyg.mesh.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.nn import DNFNet

STAGES = ("read", "prepare", "patches", "network", "fuse", "update", "write")


def make_files(folder):
    for subdivisions in (5, 6):  # 20,480 and 81,920 faces
        clean = trimesh.creation.icosphere(subdivisions=subdivisions)
        pos, face = torch.tensor(clean.vertices), torch.tensor(clean.faces).t().contiguous()
        noisy = GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0))
        write_mesh(clean, noisy, folder / f"sphere{subdivisions}.obj")
        yield folder / f"sphere{subdivisions}.obj"


def measure(path, net, output):
    start = time.perf_counter()
    mesh = read_mesh(path)
    read = time.perf_counter() - start
    result = denoise(mesh.mesh, net)
    start = time.perf_counter()
    write_mesh(mesh, result.pos, output)
    return mesh.face.size(1), {"read": read, **result.seconds, "write": time.perf_counter() - start}


def main():
    torch.manual_seed(0)
    net = DNFNet().eval()  # full size; time does not depend on the weights
    print("   faces " + " ".join(f"{stage:>8}" for stage in (*STAGES, "total")) + "  not network  peak memory")
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(word) for word in sys.argv[1:]] or list(make_files(Path(folder)))
        measure(files[0], net, Path(folder) / f"warm{files[0].suffix}")  # compilation
        for path in files:
            num_faces, seconds = measure(path, net, Path(folder) / f"out{path.suffix}")
            total = sum(seconds.values())
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
            shown = " ".join(f"{seconds[stage]:8.2f}" for stage in STAGES)
            print(
                f"{num_faces:8} {shown} {total:8.2f}  {1 - seconds['network'] / total:11.0%}  {peak:8.2f} GiB",
                flush=True,
            )


if __name__ == "__main__":
    main()
