"""Noise of real scans beside that of the noise models and virtual cameras: ``measure_noise.py [cameras] [estimates]``.

``cameras`` (the default) prints for every pair in ``../shared/data/real`` and for every simulation on the same clean
mesh or on a shape: the mean angle theta, the standard deviation of the error in mean edge lengths and its correlation
at vertices one to six edges apart, along the viewing ray from the origin and along the vertex normal. ``estimates``
prints what :func:`estimate_noise` finds on the noisy meshes alone, beside the truth.
"""

import sys
import time
from pathlib import Path

import numpy as np
import torch
import trimesh

from dnf_pyg.mesh.correlation import correlation_by_ring
from dnf_pyg.mesh.geometry import angular_difference, face_normals, mean_edge_length, vertex_normals
from dnf_pyg.mesh.noise import NOISE_KINDS
from dnf_pyg.mesh.noise_level import estimate_noise
from dnf_pyg.synthetic.depth_camera import KinectFusion, KinectV1, KinectV2, StructuredLight
from dnf_pyg.synthetic.shapes import SHAPES

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


def real_pairs():
    """Name, clean and noisy vertices and faces of the real scans; no clean vertices where there are none."""
    for path in sorted((DATA / "real").glob("*.npz")):
        scan = np.load(path)
        clean = torch.from_numpy(scan["gt"]).double() if "gt" in scan else None
        noisy = torch.from_numpy(scan["k1"] if "gt" in scan else scan["noisy"]).double()
        yield path.stem, clean, noisy, torch.from_numpy(scan["faces"].astype(np.int64)).t()


def simulations():
    """Name, clean and noisy vertices and faces of shapes under the noise models and the cameras."""
    generator = torch.Generator().manual_seed(0)
    pos, face = SHAPES["pebble"](generator, 20000)
    for name, kind in NOISE_KINDS.items():
        yield f"{name} 0.2", pos, kind()(pos, face, 0.2, generator), face
    cameras = [KinectV1(0.75, 0.3), KinectV2(0.75, 0.3), KinectFusion(0.75, 0.3), StructuredLight()]
    for camera in cameras:
        view = camera(pos, face, torch.eye(3, dtype=torch.double), generator)
        yield type(camera).__name__, view.clean, view.noisy, view.face
    for name, clean, _, face in real_pairs():
        if name.startswith("kinect_v1"):
            for camera in (KinectV1(), KinectFusion()):
                noisy = 1000 * camera.measure(clean / 1000, face, generator)
                yield f"{type(camera).__name__} on {name}", clean, noisy, face


def benchmark():
    """Name, clean and noisy vertices and faces of the synthetic test meshes."""
    folder = DATA / "cnr" / "Synthetic" / "test"
    for path in sorted((folder / "noisy").glob("*.obj")):
        paths = path, folder / "original" / f"{path.stem[:-3]}.obj"
        noisy, clean = (trimesh.load_mesh(path, process=False, maintain_order=True) for path in paths)
        vertices = torch.tensor(clean.vertices), torch.tensor(noisy.vertices)
        yield path.stem, *vertices, torch.tensor(noisy.faces).t().contiguous()


def along(clean, noisy, direction):
    """Signed error of each vertex along a direction."""
    return ((noisy - clean) * direction).sum(1)


def cameras():
    print(f"{'':34} faces  theta  direction   level  correlation at 1 to 6 edges")
    for name, clean, noisy, face in (*real_pairs(), *simulations()):
        if clean is None:
            continue
        theta = angular_difference(face_normals(noisy, face), face_normals(clean, face)).mean()
        unit = mean_edge_length(clean, face)
        rays = torch.nn.functional.normalize(clean, dim=1)
        for direction, vectors in (("ray", rays), ("normal", vertex_normals(clean, face))):
            error = along(clean, noisy, vectors)
            rings = " ".join(f"{value:5.2f}" for value in correlation_by_ring(error, face, 6))
            print(f"{name:34} {face.size(1):6} {theta:5.2f}  {direction:9} {error.std() / unit:6.3f}  {rings}")


def estimates():
    print(f"{'':34} faces   level: true  estimate   correlation: true  estimate  seconds")
    for name, clean, noisy, face in (*benchmark(), *real_pairs(), *simulations()):
        level = correlation = float("nan")
        if clean is not None:
            error = along(clean, noisy, vertex_normals(clean, face))
            level = float(error.std() / mean_edge_length(clean, face))
            (correlation,) = correlation_by_ring(error, face, 1)
        start = time.process_time()
        found = estimate_noise(noisy, face)
        seconds = time.process_time() - start
        print(
            f"{name:34} {face.size(1):6} {level:13.2f} {found.level:9.2f} {correlation:19.2f} "
            f"{found.correlation:9.2f} {seconds:8.2f}"
        )


if __name__ == "__main__":
    for part in sys.argv[1:] or ["cameras"]:
        {"cameras": cameras, "estimates": estimates}[part]()
