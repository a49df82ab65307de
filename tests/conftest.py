"""Meshes that the tests share: made in code, or the benchmark where a checkout has it beside it."""

from pathlib import Path

import pytest
import torch
import trimesh
from hypothesis import HealthCheck, settings

torch.set_num_threads(1)  # tiny inputs: threads cost more than they bring
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")  # a busy machine fails no test


def as_tensors(mesh: trimesh.Trimesh) -> tuple[torch.Tensor, torch.Tensor]:
    """Positions (V, 3) float64 and faces (3, F) of a trimesh."""
    pos = torch.tensor(mesh.vertices, dtype=torch.float64)
    return pos, torch.tensor(mesh.faces, dtype=torch.long).t().contiguous()


@pytest.fixture
def sphere_mesh():
    """Unit icosphere: 162 vertices, 320 faces, closed and smooth."""
    return as_tensors(trimesh.creation.icosphere(subdivisions=2))


@pytest.fixture
def cube_mesh():
    """Cube with 768 faces and sharp edges, side 2 about the origin."""
    cube = trimesh.creation.box(extents=(2, 2, 2))
    for _ in range(3):
        cube = cube.subdivide()
    return as_tensors(cube)


@pytest.fixture
def make_test_set(tmp_path):
    """Writes clean meshes, by name, as a test set ``set/test``, each with noise n1 and n2 that any method can take."""

    def make(shapes):
        folder = tmp_path / "set" / "test"
        generator = torch.Generator().manual_seed(0)
        for part in ("original", "noisy"):
            (folder / part).mkdir(parents=True)
        for name, clean in shapes.items():
            clean.export(folder / "original" / f"{name}.obj", digits=17)
            for level in (1, 2):
                noisy = clean.copy()
                noisy.vertices += 0.02 * level * torch.randn(clean.vertices.shape, generator=generator).numpy()
                noisy.export(folder / "noisy" / f"{name}_n{level}.obj", digits=17)
        return folder

    return make


@pytest.fixture
def test_set(make_test_set):
    """Folder with a ball and a box, each with noise n1 and n2."""
    return make_test_set(
        {"ball": trimesh.creation.icosphere(subdivisions=2), "box": trimesh.creation.box().subdivide()}
    )


@pytest.fixture(scope="session")
def cnr_root():
    """The CNR benchmark beside the checkout; tests that use it skip where it is absent."""
    root = Path(__file__).resolve().parents[2] / "shared" / "data" / "cnr"
    if not root.is_dir():
        pytest.skip("the CNR benchmark is not beside this checkout (../shared/data/cnr)")
    return root


@pytest.fixture(scope="session")
def cnr_folder(tmp_path_factory):
    """Tiny meshes in the layout of the CNR benchmark: two to train on, one to test on, in each subset."""
    root = tmp_path_factory.mktemp("cnr")
    generator = torch.Generator().manual_seed(0)
    shapes = {"ball": trimesh.creation.icosphere(subdivisions=2), "box": trimesh.creation.box().subdivide_loop(3)}
    for subset in ("Synthetic", "Kinect_v1", "Kinect_v2", "Kinect_Fusion"):
        for split, names in (("train", ("ball", "box")), ("test", ("ball",))):
            for part in ("original", "noisy"):
                (root / subset / split / part).mkdir(parents=True)
            for name in names:
                clean = shapes[name]
                clean.export(root / subset / split / "original" / f"{name}.obj")
                for ending in ("n1", "n2") if subset == "Synthetic" else ("noisy",):
                    noisy = clean.copy()
                    noisy.vertices += 0.02 * torch.randn(clean.vertices.shape, generator=generator).numpy()
                    noisy.export(root / subset / split / "noisy" / f"{name}_{ending}.obj")
    return root
