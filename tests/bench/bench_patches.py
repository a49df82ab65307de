"""Cost of patch preparation; arguments choose parts: ``bench_patches.py mesh cover growths dataset scale``.

All seconds are processor seconds of one thread, which other work on the machine does not change much; the data sets
are prepared on two threads, so their wall time is about half.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import torch
import trimesh

from dnf_pyg.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import DijkstraGrowth, FacetGraph, HeatGrowth, filled_face_normals, nearest_faces
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.patches import PatchExtractor, PatchOptions, cover, patch_to_data

CNR = Path(__file__).resolve().parents[3] / "shared" / "data" / "cnr" / "Synthetic"


def median(function, repeats=5):
    """Median processor seconds of a call, after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return statistics.median(times)


def resident():
    """Largest resident memory of this process so far, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def noisy(name):
    mesh = read_mesh(CNR / "test" / "noisy" / f"{name}_n2.obj")
    return mesh.pos, mesh.face


def bench_mesh():
    """One large mesh: the targets of the design."""
    pos, face = noisy("chinese_lion")
    graph = FacetGraph.from_mesh(pos, face)
    print(f"chinese_lion, {graph.num_faces:,} faces, one thread")
    print(f"  facet graph                    {median(lambda: FacetGraph.from_mesh(pos, face), 3):8.2f} s")
    for k in (50, 150):
        print(f"  K={k:<3} of the whole mesh         {median(lambda k=k: nearest_faces(graph, k), 3):8.2f} s")
    seeds = iter(torch.randint(graph.num_faces, (10000,), generator=torch.Generator().manual_seed(0)).tolist())
    for growth in (DijkstraGrowth(), HeatGrowth()):
        start = time.process_time()
        bound = growth.bind(pos, face, graph)
        print(f"  {growth!r:<18} bind         {time.process_time() - start:8.2f} s")
        print(f"  {growth!r:<18} grow 800     {1e3 * median(lambda b=bound: b.grow(next(seeds), 800), 41):8.2f} ms")
    normal = filled_face_normals(pos, face)
    for k in (50, 150):
        extractor = PatchExtractor(pos, face, k=k)
        time_extract = median(lambda e=extractor: e.extract(next(seeds)), 41)
        time_data = median(lambda e=extractor: patch_to_data(e.extract(next(seeds)), normal), 41)
        print(f"  K={k:<3} patch {1e3 * time_extract:6.2f} ms; with Data {1e3 * time_data:6.2f} ms")


def bench_cover():
    """Patches of 800 faces that cover a mesh."""
    print("mesh               faces  m  patches  patches x 800 / (m faces)  naive  seconds (plan and all patches)")
    for name in ("block", "bunny_hi", "chinese_lion"):
        extractor = PatchExtractor(*noisy(name))
        for m in (1, 2):
            start = time.process_time()
            count = sum(1 for _ in cover(extractor, m, torch.Generator().manual_seed(0)))
            seconds = time.process_time() - start
            covered = np.zeros(extractor.num_faces, int)
            naive = 0
            order = np.random.default_rng(0).permutation(extractor.num_faces)
            for turn in range(m):
                for seed in order.tolist():
                    if covered[seed] <= turn:
                        covered[extractor.growth.grow(seed, 800)[0]] += 1
                        naive += 1
            ratio = count * 800 / extractor.num_faces / m
            print(f"{name:<14} {extractor.num_faces:>9,}  {m}  {count:>7}  {ratio:>25.2f}  {naive:>5}  {seconds:.2f}")


def bench_growths():
    """Faces that patches of both growths share, twelve test meshes with noise level 2."""
    print("mesh               faces  shared (mean of 30 patches)  smallest")
    for path in sorted((CNR / "test" / "noisy").glob("*_n2.obj")):
        pos, face = noisy(path.stem.removesuffix("_n2"))
        graph = FacetGraph.from_mesh(pos, face)
        both = [growth.bind(pos, face, graph) for growth in (DijkstraGrowth(), HeatGrowth())]
        seeds = torch.randint(face.size(1), (30,), generator=torch.Generator().manual_seed(0)).tolist()
        shared = [len(np.intersect1d(*(bound.grow(seed, 800)[0] for bound in both))) / 800 for seed in seeds]
        print(f"{path.stem:<18} {face.size(1):>6,}  {100 * statistics.mean(shared):>26.1f}%  {100 * min(shared):.1f}%")


def bench_dataset():
    """Preparation, size and serving of the training set."""
    names = sorted(path.stem for path in (CNR / "train" / "original").glob("*.obj"))[:40]
    fixed = [
        (CNR / "train" / "noisy" / f"{name}_n{level}.obj", CNR / "train" / "original" / f"{name}.obj")
        for name in names
        for level in (1, 2, 3)
    ]
    alone = [(None, clean) for _, clean in fixed[::3]]
    for label, kind, pairs, patches, noise in (
        ("fixed pairs, K=50", PatchDataset, fixed, PatchOptions(), None),
        ("fresh noise, K=50", PatchDataset, alone, PatchOptions(), GaussianNormalNoise()),
        ("fresh patches and noise, K=50", FreshPatchDataset, alone, PatchOptions(), GaussianNormalNoise()),
        ("fixed pairs, K=150, 200 patches, 6 meshes", PatchDataset, fixed[::20], PatchOptions(200, k=150), None),
    ):
        with tempfile.TemporaryDirectory() as root:
            start = time.process_time()
            dataset = kind(root, pairs, patches, noise=noise)
            seconds = time.process_time() - start
            size = sum(file.stat().st_size for file in Path(root).rglob("*.npy"))
            torch.manual_seed(0)
            order = torch.randperm(len(dataset))[:300].tolist()
            times = []
            for i in order:
                begin = time.process_time()
                dataset[i]
                times.append(time.process_time() - begin)
            print(
                f"{label}: {len(pairs)} meshes, {len(dataset)} patches, prepared in {seconds:.0f} s, "
                f"{size / 1e9:.3f} GB, {size / len(dataset) / 1e3:.0f} kB a patch, "
                f"{1e3 * statistics.median(times):.1f} ms to serve one, {resident():.2f} GB resident"
            )


def bench_scale(faces=(10_000, 100_000, 1_000_000)):
    """Cost per face from file to all patches of a 2-fold cover, one process per size."""
    print("   faces   read s  graph s  patches   cover s   us per face  resident GB")
    for count in faces:
        subprocess.run([sys.executable, __file__, "one", str(count)], check=True)


def one_scale(count):
    side = int((count / 2) ** 0.5)
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0))
    rng = np.random.default_rng(0)
    z = 4 * np.sin(x / 9) * np.cos(y / 7)
    pos = np.stack([x, y, z], axis=-1).reshape(-1, 3) + rng.normal(scale=0.2, size=((side + 1) ** 2, 3))
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    lower = np.stack([corner, corner + 1, corner + side + 1], axis=1)
    upper = np.stack([corner + 1, corner + side + 2, corner + side + 1], axis=1)
    with tempfile.TemporaryDirectory() as root:
        path = Path(root) / "mesh.ply"
        trimesh.Trimesh(pos, np.concatenate([lower, upper]), process=False).export(path)
        list(cover(PatchExtractor(*noisy("cube")), 2))  # compiled code is loaded
        start = time.process_time()
        mesh = read_mesh(path)
        read = time.process_time()
        extractor = PatchExtractor(mesh.pos, mesh.face)
        graph = time.process_time()
        normal = filled_face_normals(mesh.pos, mesh.face)
        patches = 0
        for patch in cover(extractor, 2, torch.Generator().manual_seed(0)):
            patches += patch_to_data(patch, normal).num_nodes > 0
        end = time.process_time()
        per_face = 1e6 * (end - start) / extractor.num_faces
        print(
            f"{extractor.num_faces:>8,}  {read - start:>7.2f}  {graph - read:>7.2f}  {patches:>7}  "
            f"{end - graph:>8.2f}  {per_face:>12.1f}  {resident():>11.2f}"
        )


PARTS = {
    "mesh": bench_mesh,
    "cover": bench_cover,
    "growths": bench_growths,
    "dataset": bench_dataset,
    "scale": bench_scale,
}


def main():
    torch.set_num_threads(1)
    parts = sys.argv[1:] or list(PARTS)
    if parts[0] == "one":
        one_scale(int(parts[1]))
        return
    for part in parts:
        if CNR.is_dir():
            PARTS[part]()
        else:
            print(f"{part}: skipped, {CNR} is not there")
        print(flush=True)


if __name__ == "__main__":
    main()
