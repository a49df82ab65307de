"""Print the tables of docs/results.md on noise and on options, with the packaged weights as they are.

``python tests/bench/measure_options.py DATA/cnr/Synthetic [PART ...]`` prints all parts or some of ``invariance``,
``folds``, ``kinds``, ``shares``, ``iterations``, ``trade`` and ``passes``. The first two take meshes of ``test``, the
others take meshes of ``train`` that the weights were not trained on. Everything runs in full precision, so that figures
do not depend on whether a processor has instructions for bf16. Nothing here is part of ``make bench``.
"""

import sys
import time
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from zlib import crc32

import numpy as np
import torch
import trimesh

from dnf_pyg import FAST, FilterOptions, denoise
from dnf_pyg.errors import DenoiseWarning
from dnf_pyg.evaluate.baselines import BASELINES
from dnf_pyg.evaluate.benchmark import ClassicalMethod
from dnf_pyg.evaluate.benchmark.tables import bold_lowest, markdown_table, number
from dnf_pyg.evaluate.measures import mean_angular_difference
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.flips import flipped_faces
from dnf_pyg.mesh.geometry import face_normals, mean_edge_length
from dnf_pyg.mesh.noise import NOISE_KINDS
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.weights.load import load_cascade
from dnf_pyg.weights.release import fingerprint

HELD_BACK = ("fandisk", "three_holes", "bumpy_cube", "Julius")
LEVELS = (0.1, 0.2, 0.3)
KINDS = {
    "Gaussian along the normal, 0.05": ("gaussian", 0.05),
    "Gaussian along the normal, 0.5": ("gaussian", 0.5),
    "uniform along the normal, 0.5": ("uniform", 0.5),
    "impulsive, 0.4": ("impulsive", 0.4),
    "Gaussian in all directions, 0.2": ("isotropic", 0.2),
    "alike at neighbouring vertices, 0.2": ("scan", 0.2),
}
SHARES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
EXACT = FilterOptions(precision="fp32")
ITERATIONS = (5, 10, 20, 40, 100)
MORE_ITERATIONS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20, 24, 28, 33, 40, 48, 57, 68, 82, 100)
TRADE = {
    "`coverage` 1": ("best", replace(EXACT, coverage=1)),
    "**default**: `coverage` 2": ("best", EXACT),
    "`coverage` 3": ("best", replace(EXACT, coverage=3)),
    "`coverage` 6": ("best", replace(EXACT, coverage=6)),
    "`--smoothing 0`": ("best", replace(EXACT, smoothing=0.0)),
    "`--weights best --fast`: `coverage` 1, fewer neighbours": ("best", replace(FAST, precision="fp32")),
    "`--weights single`": ("single", EXACT),
    "`--weights small`": ("small", EXACT),
    "**`--fast`**: `small`, `coverage` 1": ("small", replace(FAST, precision="fp32")),
}
QUARTER = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
SKEW = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3))[:3, :3]


def noisy(data, name, kind="gaussian", level=0.2):
    """Noisy vertices, faces and clean normals of a mesh that the weights were not trained on."""
    mesh = read_mesh(data / "train" / "original" / f"{name}.obj")
    generator = torch.Generator().manual_seed(crc32(f"{name} {kind} {level}".encode()))
    return NOISE_KINDS[kind]()(mesh.pos, mesh.face, level, generator), mesh.face, face_normals(mesh.pos, mesh.face)


@cache
def denoised(net, data, name, level, num_passes=1):
    """Result on a mesh of :func:`noisy`, for several tables."""
    pos, face, _ = noisy(data, name, level=level)
    return denoise((pos, face.t()), net, filtering=EXACT, num_passes=num_passes)


def theta(pos, face, clean):
    return mean_angular_difference(face_normals(pos, face), clean)


def table(header, rows):
    print(markdown_table(header, rows), flush=True)


def invariance(net, data, name="block_n3"):
    mesh = read_mesh(data / "test" / "noisy" / f"{name}.obj")
    unit = float(mean_edge_length(mesh.pos, mesh.face))
    size = float((mesh.pos.amax(dim=0) - mesh.pos.amin(dim=0)).max())
    expected = denoise(mesh.mesh, net, filtering=EXACT).pos.numpy()
    changes = {
        "scaled by 0.001": (0.001 * np.eye(3), 0.0),
        "scaled by 1000": (1000 * np.eye(3), 0.0),
        "moved by 1,000 mean edge lengths": (np.eye(3), 1000 * unit),
        "moved by 10,000 times its size": (np.eye(3), 10_000 * size),
        "rotated by 90 degrees": (QUARTER, 0.0),
        "rotated about an oblique axis": (SKEW, 0.0),
    }
    rows = []
    for change, (matrix, shift) in changes.items():
        moved = trimesh.Trimesh(mesh.pos.numpy() @ matrix.T + shift, mesh.face.t().numpy(), process=False)
        back = (denoise(moved, net, filtering=EXACT).pos.numpy() - shift) @ np.linalg.inv(matrix).T
        apart = np.linalg.norm(back - expected, axis=1) / unit
        rows.append([change, *(f"{value:.0e}" for value in (apart.max(), np.quantile(apart, 0.999), np.median(apart)))])
    table(["input", "largest", "99.9% of the vertices", "median"], rows)


def folds(net, data):
    """Faces more than 90 degrees from their filtered normal after 100 iterations."""
    rows = []
    for name in ("block_n3", "cube_n3", "kitten_n3"):
        mesh = read_mesh(data / "test" / "noisy" / f"{name}.obj")
        normal = denoise(mesh.mesh, net, filtering=EXACT).normal.double()
        results = (update_vertices(mesh.pos, mesh.face, normal, 100, guard=guard) for guard in (False, True))
        rows.append([name, *(str(int(flipped_faces(pos, mesh.face, normal).sum())) for pos in results)])
    table(["faces folded over", "without the guard", "with it"], rows)


def kinds(net, data):
    filters = [ClassicalMethod(name, BASELINES[name]()) for name in ("BNF", "GNF")]
    rows = []
    for title, (kind, level) in KINDS.items():
        results = []
        for name in HELD_BACK[:3]:
            pos, face, clean = noisy(data, name, kind, level)
            ours = denoise((pos, face.t()), net, filtering=EXACT).pos
            found = [pos, ours, *(method(name, pos, face).pos for method in filters)]
            results.append([theta(pos, face, clean) for pos in found])
        first, *others = torch.tensor(results).mean(dim=0).tolist()
        rows.append([title, number(first), *bold_lowest(others)])
    table(["noise", "noisy", "best", *(method.name for method in filters)], rows)


def shares(_, data):
    """Theta of networks by the share of the angle of the noise up to which their normals are smoothed."""
    options = [replace(EXACT, smoothing=share) for share in SHARES]
    rows = []
    for weights in ("single", "small", "synthetic"):
        net = load_cascade(weights)
        for level in (0.1, 0.3):
            results = []
            for name in HELD_BACK[:3]:
                pos, face, clean = noisy(data, name, level=level)
                found = [denoise((pos, face.t()), net, filtering=filtering).pos for filtering in options]
                results.append([theta(end, face, clean) for end in found])
            rows.append([f"`{weights}`", f"{level}", *bold_lowest(torch.tensor(results).mean(dim=0).tolist())])
    table(["network", "noise", *map(str, SHARES)], rows)


def iterations(net, data):
    """Theta after fixed numbers of iterations, where the update stops, and after the best number for each mesh."""
    results = {f"{count}": [] for count in ITERATIONS} | {"**automatic**": [], "best of each": []}
    for name in HELD_BACK:
        values = []
        for level in LEVELS:
            pos, face, clean = noisy(data, name, level=level)
            result = denoised(net, data, name, level)
            normal = result.normal.double()
            found = {n: theta(update_vertices(pos, face, normal, n), face, clean) for n in MORE_ITERATIONS}
            values.append([*map(found.get, ITERATIONS), theta(result.pos, face, clean), min(found.values())])
        for column, mean in zip(results.values(), torch.tensor(values).mean(dim=0).tolist(), strict=True):
            column.append(mean)
    table(["iterations", *HELD_BACK, "all"], with_mean(results))


def trade(_, data):
    """Theta and processor time of options, the time of the default as the unit."""
    results, seconds = {title: [] for title in TRADE}, dict.fromkeys(TRADE, 0.0)
    for name in HELD_BACK:
        meshes = [noisy(data, name, level=level) for level in LEVELS]
        for title, (weights, filtering) in TRADE.items():
            net = load_cascade(weights)
            start = time.process_time()
            found = [denoise((pos, face.t()), net, filtering=filtering).pos for pos, face, _ in meshes]
            seconds[title] += time.process_time() - start
            values = [theta(pos, face, clean) for pos, (_, face, clean) in zip(found, meshes, strict=True)]
            results[title].append(sum(values) / len(values))
    unit = seconds["**default**: `coverage` 2"]
    rows = with_mean(results)
    table(["", *HELD_BACK, "all", "time"], [[*row, f"{seconds[row[0]] / unit:.2f}"] for row in rows])


def passes(net, data):
    rows = []
    for level in LEVELS:
        cells = []
        for name in HELD_BACK:
            _, face, clean = noisy(data, name, level=level)
            found = [denoised(net, data, name, level, n).pos for n in (1, 2)]
            cells.append(", ".join(f"{theta(end, face, clean):.2f}" for end in found))
        rows.append([f"{level}", *cells])
    table(["noise", *HELD_BACK], rows)


def with_mean(results):
    """Rows of a table: the title, a value for each mesh and their mean."""
    return [[title, *map(number, (*values, sum(values) / len(values)))] for title, values in results.items()]


PARTS = {part.__name__: part for part in (invariance, folds, kinds, shares, iterations, trade, passes)}


def main():
    warnings.simplefilter("ignore", DenoiseWarning)  # of noise above the levels of the training
    net = load_cascade("best")
    for name in sys.argv[2:] or PARTS:
        print(f"\n{name}, weights {fingerprint(net)}")
        PARTS[name](net, Path(sys.argv[1]))


if __name__ == "__main__":
    main()
