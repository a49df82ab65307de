"""Denoise large and degenerate meshes: processor time and memory for each face, beside those of a plain mesh.

    python tests/bench/bench_scale.py [CASE ...]

Every case runs in a process of its own within limits of time and memory: what grows with the square of the mesh ends
in a row of the table. Bars: 4 GiB, and three times the time that a face of the plain mesh takes.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
import warnings
from dataclasses import replace
from pathlib import Path

import torch
import trimesh

from dnf_pyg import FAST, denoise, load_network
from dnf_pyg.errors import DenoiseWarning

SECONDS, BYTES = 120, 4 << 30  # processor time and memory of one case
PATIENCE = 10  # seconds of waiting per second of processor time, where the machine has other work


def sphere(subdivisions):
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    return torch.tensor(ball.vertices), torch.tensor(ball.faces).t()


def fan(count, *, shuffled=False):
    """A cone of ``count`` faces around one vertex."""
    rim = torch.arange(count)
    angle = 2 * torch.pi * rim.double() / count
    pos = torch.stack([angle.cos(), angle.sin(), torch.zeros(count)], dim=1)
    face = torch.stack([torch.zeros_like(rim), rim + 1, (rim + 1) % count + 1])
    order = torch.randperm(count, generator=torch.Generator().manual_seed(0)) if shuffled else rim
    return torch.cat([torch.tensor([[0.0, 0.0, 1.0]]), pos]), face[:, order]


def singles(count):
    """Triangles that share no vertex."""
    shift = torch.arange(count).double()[:, None, None] * torch.tensor([3.0, 0.0, 0.0])
    corner = torch.eye(3, dtype=torch.double)[None] + shift
    return corner.reshape(-1, 3), torch.arange(3 * count).view(count, 3).t()


def islands(count):
    """Pairs, strips and balls: small components of many sizes."""
    parts = [trimesh.creation.icosphere(subdivisions=level) for level in (0, 1)] + [trimesh.creation.box()]
    pos, face, first = [], [], 0
    for number in range(count):
        part = parts[number % 3]
        pos.append(torch.tensor(part.vertices) + torch.tensor([3.0 * number, 0.0, 0.0]))
        face.append(torch.tensor(part.faces).t() + first)
        first += len(part.vertices)
    return torch.cat(pos), torch.cat(face, dim=1)


def giant():
    """A sphere with a flap whose two long edges are a million times longer than those of the sphere."""
    pos, face = sphere(6)
    edge = (pos[face[0, 0]] - pos[face[1, 0]]).norm()
    far = pos[face[0, 0]] * 1e6 * edge
    flap = torch.stack([face[1, 0], face[0, 0], torch.tensor(len(pos))])
    return torch.cat([pos, far[None]]), torch.cat([face, flap[:, None]], dim=1)


def copies(interleaved):
    """Every face 50 times, one after the other or the whole mesh again and again."""
    ring = trimesh.creation.torus(1.0, 0.4, major_sections=50, minor_sections=40)
    face = torch.tensor(ring.faces).t()
    return torch.tensor(ring.vertices), face.repeat(1, 50) if interleaved else face.repeat_interleave(50, dim=1)


CASES = {
    "plain": lambda: sphere(6),
    "plain, 4 times": lambda: sphere(7),
    "fan": lambda: fan(100_000),
    "fan, shuffled": lambda: fan(100_000, shuffled=True),
    "single triangles": lambda: singles(200_000),
    "small components": lambda: islands(5_000),
    "giant face": giant,
    "copies": lambda: copies(interleaved=False),
    "copies of the mesh": lambda: copies(interleaved=True),
}


def run(case):
    """Denoise one mesh and print the figures as JSON."""
    warnings.simplefilter("ignore", DenoiseWarning)
    net, settings = load_network("single"), replace(FAST, precision="bf16")
    pos, face = sphere(4)
    denoise((pos.numpy(), face.t().numpy()), net, filtering=settings)  # compilation and first touch
    pos, face = CASES[case]()
    edge = (pos[face[0]] - pos[face[1]]).norm(dim=1).median()
    pos = pos + 0.1 * edge * torch.randn(pos.shape, dtype=pos.dtype, generator=torch.Generator().manual_seed(0))
    Path("/proc/self/clear_refs").write_text("5")
    busy = time.process_time()
    resource.setrlimit(resource.RLIMIT_CPU, (int(busy) + SECONDS, -1))
    result = denoise((pos.numpy(), face.t().numpy()), net, filtering=settings)
    seconds = time.process_time() - busy
    lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024
    print(json.dumps({"faces": face.size(1), "seconds": seconds, "peak": peak, "stages": result.seconds}))


def measure(case):
    """Figures of one case, or why there are none."""
    words = [sys.executable, __file__, "--run", case]
    try:
        done = subprocess.run(
            words,
            check=False,
            capture_output=True,
            text=True,
            timeout=SECONDS * PATIENCE,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (BYTES, BYTES)),
        )
    except subprocess.TimeoutExpired:
        return f"stopped after {SECONDS * PATIENCE} s of waiting"
    if done.returncode == 0:
        return json.loads(done.stdout.splitlines()[-1])
    if done.returncode == -24:  # SIGXCPU
        return f"stopped after {SECONDS} processor seconds"
    return (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1][:90]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", help=f"some of: {', '.join(CASES)}; all by default, the plain mesh always")
    parser.add_argument("--run", choices=CASES, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.run:
        run(args.run)
        return
    print(f"{'case':20} {'faces':>8} {'cpu s':>8} {'us/face':>8} {'ratio':>6} {'GiB':>6}  wall seconds by stage")
    plain = float("nan")
    for case in dict.fromkeys(["plain", *(args.cases or CASES)]):
        found = measure(case)
        if isinstance(found, str):
            print(f"{case:20} {found}", flush=True)
            continue
        each = 1e6 * found["seconds"] / found["faces"]
        plain = each if case == "plain" else plain
        stages = ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in found["stages"].items())
        print(f"{case:20} {found['faces']:8} {found['seconds']:8.2f} {each:8.1f} {each / plain:6.2f} "
              f"{found['peak'] / 2**30:6.2f}  {stages}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
