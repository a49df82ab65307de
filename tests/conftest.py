"""Meshes that the tests share: made in code, or the benchmark where a checkout has it beside it."""

from pathlib import Path

import pytest
import torch
import trimesh

torch.set_num_threads(1)  # tiny inputs: threads cost more than they bring


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


@pytest.fixture(scope="session")
def cnr_root():
    """The CNR benchmark beside the checkout; tests that use it skip where it is absent."""
    root = Path(__file__).resolve().parents[2] / "shared" / "data" / "cnr"
    if not root.is_dir():
        pytest.skip("the CNR benchmark is not beside this checkout (../shared/data/cnr)")
    return root
