"""A tiny test set, and methods that count their calls."""

import pytest
import torch
import trimesh

from dnf_pyg.benchmark import Result
from dnf_pyg.mesh.geometry import face_normals


@pytest.fixture
def test_set(tmp_path):
    """Folder with a ball and a box, each with noise n1 and n2."""
    folder = tmp_path / "data" / "test"
    generator = torch.Generator().manual_seed(0)
    for part in ("original", "noisy"):
        (folder / part).mkdir(parents=True)
    shapes = {"ball": trimesh.creation.icosphere(subdivisions=2), "box": trimesh.creation.box().subdivide()}
    for name, clean in shapes.items():
        clean.export(folder / "original" / f"{name}.obj", digits=17)
        for level in (1, 2):
            noisy = clean.copy()
            noisy.vertices += 0.02 * level * torch.randn(clean.vertices.shape, generator=generator).numpy()
            noisy.export(folder / "noisy" / f"{name}_n{level}.obj", digits=17)
    return folder


class Scaled:
    """Multiplies all positions; fails on the mesh called ``fails_on``."""

    def __init__(self, name, factor=1.0, fails_on=None):
        self.name, self.factor, self.fails_on = name, factor, fails_on
        self.calls = []

    def parameters(self, noisy):
        return f"factor={self.factor}"

    def __call__(self, noisy, pos, face):
        if noisy == "sphere":  # the warm-up
            return Result(pos, None, None)
        self.calls.append(noisy)
        if noisy == self.fails_on:
            raise RuntimeError("cannot\ndo that")
        return Result(self.factor * pos, face_normals(pos, face), 0.5)


@pytest.fixture
def scaled():
    return Scaled
