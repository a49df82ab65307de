"""What docs/denoising.md says of the vertex update and of other frames, measured on the benchmark beside the checkout.

Arguments: any of ``invariance``, ``folds`` and ``iterations``; all of them if not given. Not part of ``make bench``:
the iterations take a network pass over 36 meshes.
"""

import sys
from pathlib import Path

import numpy as np
import torch
import trimesh

from dnf_pyg import FAST, denoise, load_network
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.flips import flipped_faces
from dnf_pyg.mesh.geometry import angular_difference, face_normals, mean_edge_length
from dnf_pyg.mesh.vertex_update import update_vertices

TEST = Path(__file__).resolve().parents[3] / "shared/data/cnr/Synthetic/test"
QUARTER = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
SKEW = trimesh.transformations.rotation_matrix(1.0, (1, 2, 3))[:3, :3]
ITERATIONS = (5, 10, 20, 40, 100)


def read(name):
    """Noisy mesh of that name, and the clean facet normals."""
    clean = read_mesh(TEST / "original" / f"{name[:-3]}.obj")
    return read_mesh(TEST / "noisy" / f"{name}.obj"), face_normals(clean.pos, clean.face)


def theta(pos, face, clean):
    return float(angular_difference(face_normals(pos, face), clean).double().mean())


def invariance(net, name="block_n3"):
    mesh, _ = read(name)
    unit = float(mean_edge_length(mesh.pos, mesh.face))
    size = float((mesh.pos.amax(dim=0) - mesh.pos.amin(dim=0)).max())
    expected = denoise(mesh.mesh, net).pos.numpy()
    changes = {
        "scaled by 0.001": (0.001 * np.eye(3), 0.0),
        "scaled by 1000": (1000 * np.eye(3), 0.0),
        "moved by 1,000 mean edge lengths": (np.eye(3), 1000 * unit),
        "moved by 10,000 times its size": (np.eye(3), 10_000 * size),
        "turned by 90 degrees": (QUARTER, 0.0),
        "turned about a skew axis": (SKEW, 0.0),
    }
    print(f"{name}: difference of vertices in mean edge lengths: largest, 99.9%, median")
    for change, (matrix, shift) in changes.items():
        moved = trimesh.Trimesh(mesh.pos.numpy() @ matrix.T + shift, mesh.face.t().numpy(), process=False)
        back = (denoise(moved, net).pos.numpy() - shift) @ np.linalg.inv(matrix).T
        apart = np.linalg.norm(back - expected, axis=1) / unit
        print(f"{change:34} {apart.max():9.1e} {np.quantile(apart, 0.999):9.1e} {np.median(apart):9.1e}", flush=True)


def folds(net):
    print("faces more than 90 degrees from their filtered normal (from the clean one), and theta")
    for name in ("block_n3", "cube_n3", "kitten_n3"):
        mesh, clean = read(name)
        result = denoise(mesh.mesh, net)
        normal = result.normal.double()

        def count(pos, mesh=mesh, normal=normal, clean=clean):
            filtered, wanted = (int(flipped_faces(pos, mesh.face, found).sum()) for found in (normal, clean))
            return f"{filtered:4} ({wanted:4})"

        for num_iterations in (20, 100):
            told = f"{name:10} {num_iterations:4} iterations   input {count(mesh.pos)}"
            for guard in (False, True):
                pos = update_vertices(mesh.pos, mesh.face, normal, num_iterations, guard=guard)
                told += f"   {'guarded' if guard else 'free'} {count(pos)} {theta(pos, mesh.face, clean):.3f}"
            print(told, flush=True)


def iterations(net):
    """The end by correlation beside fixed numbers of iterations."""
    print("theta after fixed numbers of iterations of the vertex update, and where it ends by itself (--fast)")
    print(f"{'':20} {' '.join(f'{steps:>7}' for steps in ITERATIONS)}  by itself")
    rows = []
    for path in sorted((TEST / "noisy").glob("*_n[123].obj")):
        mesh, clean = read(path.stem)
        result = denoise(mesh.mesh, net, filtering=FAST)
        normal = result.normal.double()
        ends = [theta(update_vertices(mesh.pos, mesh.face, normal, steps), mesh.face, clean) for steps in ITERATIONS]
        rows.append([*ends, theta(result.pos, mesh.face, clean)])
        print(f"{path.stem:20} {' '.join(f'{value:7.3f}' for value in rows[-1])}", flush=True)
    print(f"{'mean':20} {' '.join(f'{value:7.3f}' for value in torch.tensor(rows).mean(dim=0).tolist())}")


def main():
    net = load_network("best")
    for measured in sys.argv[1:] or ("invariance", "folds", "iterations"):
        {"invariance": invariance, "folds": folds, "iterations": iterations}[measured](net)


if __name__ == "__main__":
    main()
