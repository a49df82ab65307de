"""Denoise from file to file: seconds by stage, memory, what bf16 and fast options cost, and classical filters.

Arguments: mesh files; else ``block`` of the benchmark beside the checkout, where it is, and a ring made in code.
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import torch
import trimesh

from dnf_pyg import FAST, FilterOptions, denoise
from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.geometry import angular_difference, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.nn import DNFNet
from dnf_pyg.weights.load import load_cascade

STAGES = ("read", "prepare", "patches", "network", "fuse", "update", "write")
SETTINGS = {
    "fp32": FilterOptions(precision="fp32"),
    "bf16": FilterOptions(precision="bf16"),
    "fast": replace(FAST, precision="fp32"),
    "fast bf16": replace(FAST, precision="bf16"),
}
BLOCK = Path(__file__).resolve().parents[3] / "shared/data/cnr/Synthetic/test/noisy/block_n2.obj"
BARS = {  # seconds for 100,000 faces on two cores
    ("full size", "fp32"): 40,
    ("full size", "bf16"): 22,
    ("small", "fast bf16"): 2,  # what --fast is on such a processor
}


def make_files(folder):
    """Noisy meshes and their clean versions."""
    if BLOCK.is_file():
        yield BLOCK, BLOCK.parents[1] / "original" / "block.obj"  # 17.5k faces
    clean = trimesh.creation.torus(1.0, 0.4, major_sections=250, minor_sections=200)  # 100,000 faces
    pos, face = torch.tensor(clean.vertices), torch.tensor(clean.faces).t().contiguous()
    write_mesh(clean, pos, folder / "ring.obj")
    write_mesh(clean, GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0)), folder / "noisy.obj")
    yield folder / "noisy.obj", folder / "ring.obj"


def network(net, settings):
    def filtered(mesh):
        result = denoise(mesh.mesh, net, filtering=settings)
        return result.pos, result.seconds

    return filtered


def classical(name):
    def filtered(mesh):
        return BASELINES[name]()(mesh.pos, mesh.face).pos, {}

    return filtered


def measure(path, clean, filtered, output):
    """Seconds by stage from file to file, processor seconds, peak memory in GiB, and theta where it can be told."""
    forget_peak()
    start, busy = time.perf_counter(), time.process_time()
    mesh = read_mesh(path)
    read = time.perf_counter() - start
    pos, seconds = filtered(mesh)
    writing = time.perf_counter()
    write_mesh(mesh, pos, output)
    now = time.perf_counter()
    seconds = {"read": read, **seconds, "write": now - writing, "total": now - start}
    seconds["cpu"] = time.process_time() - busy
    theta = None
    if clean is not None:
        wanted = read_mesh(clean)
        theta = float(
            angular_difference(face_normals(pos, mesh.face), face_normals(wanted.pos, wanted.face)).double().mean()
        )
    return mesh.face.size(1), seconds, peak(), theta


def forget_peak():
    if Path("/proc/self/clear_refs").exists():
        Path("/proc/self/clear_refs").write_text("5")


def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 2**20


def row(method, settings, num_faces, seconds, memory, theta):
    stages = " ".join(f"{seconds[stage]:7.2f}" if stage in seconds else " " * 7 for stage in (*STAGES, "total", "cpu"))
    share = f"{1 - seconds['network'] / seconds['total']:6.0%}" if "network" in seconds else " " * 6
    shown = "      -" if theta is None else f"{theta:7.3f}"
    print(f"{method:10} {settings:10} {num_faces:7} {stages} {share} {memory:6.2f} {shown}", flush=True)


def summary(found):
    """What the rows of one mesh, by method and settings, say together."""
    for names, bar in BARS.items():
        num_faces, seconds, *_ = found[names]
        per_100k = seconds["total"] * 1e5 / num_faces
        print(f"  {', '.join(names)}: {per_100k:.1f} s for 100,000 faces (at most {bar} are wanted), "
              f"{1 - seconds['network'] / seconds['total']:.0%} of it not the network")  # fmt: skip
    thetas = {name: found["packaged", name][3] for name in SETTINGS}
    if None not in thetas.values():
        difference = {name: theta - thetas["fp32"] for name, theta in thetas.items()}
        told = ", ".join(f"{name} {value:+.4f}" for name, value in difference.items() if name != "fp32")
        print(f"  theta against fp32 (at most 0.02 in bf16, 0.2 in fast): {told} degrees")
        small = found["small", "fast bf16"][3] - thetas["fp32"]
        print(f"  theta of --fast against the default (at most 0.25): {small:+.4f} degrees")
    for name in ("BNF", "GNF"):
        base = found["classical", name][1]["total"]
        told = ", ".join(f"{settings} {found['packaged', settings][1]['total'] / base:.1f}" for settings in SETTINGS)
        print(f"  packaged, times the {base:.1f} s of {name}: {told}")


def main():
    torch.manual_seed(0)
    full, packaged, small = DNFNet().eval(), load_cascade("best"), load_cascade("small")
    methods = {("full size", name): network(full, SETTINGS[name]) for name in ("fp32", "bf16")}  # weights do not matter
    methods |= {("packaged", name): network(packaged, settings) for name, settings in SETTINGS.items()}
    methods |= {("small", name): network(small, SETTINGS[name]) for name in ("bf16", "fast bf16")}
    methods |= {("classical", name): classical(name) for name in ("BNF", "GNF")}
    print(f"{torch.get_num_threads()} threads; seconds; cpu: processor seconds of all threads; other: share of what is "
          "not the network; GiB: peak; theta of the updated mesh in degrees")  # fmt: skip
    print("method     settings     faces " + " ".join(f"{stage:>7}" for stage in (*STAGES, "total", "cpu"))
          + "  other    GiB   theta")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        given = [(Path(word), None) for word in sys.argv[1:]]
        first = Path(folder) / "first.obj"
        ball = trimesh.creation.icosphere(subdivisions=4)
        write_mesh(ball, torch.tensor(ball.vertices), first)
        for filtered in methods.values():
            measure(first, None, filtered, Path(folder) / "warm.obj")  # compilation and first touch
        for path, clean in given or make_files(Path(folder)):
            found = {}
            for names, filtered in methods.items():
                found[names] = measure(path, clean, filtered, Path(folder) / f"out{path.suffix}")
                row(*names, *found[names])
            summary(found)


if __name__ == "__main__":
    main()
