"""Methods that count their calls."""

import pytest

from dnf_pyg.evaluate.benchmark import Result
from dnf_pyg.mesh.geometry import face_normals


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
