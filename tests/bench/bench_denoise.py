"""Denoise from file to file: seconds by stage, and peak memory.

Arguments: mesh files; else ``block`` of the benchmark beside the checkout, where it is, and a ring made in code.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import torch
import trimesh

from dnf_pyg import FAST, denoise, load_network
from dnf_pyg.mesh.io import read_mesh, write_mesh
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.nn import DNFNet

STAGES = ("read", "prepare", "patches", "network", "fuse", "update", "write")
BLOCK = Path(__file__).resolve().parents[3] / "shared/data/cnr/Synthetic/test/noisy/block_n2.obj"


def make_files(folder):
    if BLOCK.is_file():
        yield BLOCK  # 17.5k faces
    clean = trimesh.creation.torus(1.0, 0.4, major_sections=250, minor_sections=200)  # 100,000 faces
    pos, face = torch.tensor(clean.vertices), torch.tensor(clean.faces).t().contiguous()
    write_mesh(clean, GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0)), folder / "torus.obj")
    yield folder / "torus.obj"


def measure(path, net, output, settings):
    start, busy = time.perf_counter(), time.process_time()
    mesh = read_mesh(path)
    read = time.perf_counter() - start
    result = denoise(mesh.mesh, net, **settings)
    start = time.perf_counter()
    write_mesh(mesh, result.pos, output)
    seconds = {"read": read, **result.seconds, "write": time.perf_counter() - start}
    return mesh.face.size(1), seconds, time.process_time() - busy


def main():
    torch.manual_seed(0)
    nets = {"full size": DNFNet().eval(), "packaged": load_network("best")}  # time does not depend on the weights
    print(f"{torch.get_num_threads()} threads; seconds; cpu: processor seconds of all threads")
    print("network    settings    faces " + " ".join(f"{stage:>7}" for stage in (*STAGES, "total", "cpu"))
          + "  not network  peak memory")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(word) for word in sys.argv[1:]] or list(make_files(Path(folder)))
        measure(files[0], nets["packaged"], Path(folder) / f"warm{files[0].suffix}", FAST)  # compilation
        for path in files:
            for net, settings in (("full size", {}), ("packaged", {}), ("packaged", dict(FAST))):
                num_faces, seconds, busy = measure(path, nets[net], Path(folder) / f"out{path.suffix}", settings)
                total = sum(seconds.values())
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
                shown = " ".join(f"{seconds[stage]:7.2f}" for stage in STAGES)
                print(
                    f"{net:10} {'fast' if settings else 'default':8} {num_faces:8} {shown} {total:7.2f} {busy:7.2f}  "
                    f"{1 - seconds['network'] / total:11.0%}  {peak:8.2f} GiB",
                    flush=True,
                )


if __name__ == "__main__":
    main()
