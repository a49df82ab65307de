"""The accessor of PyVista; a module stands in for PyVista, which the tests do not need."""

import copy
import importlib
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch
import trimesh

import dnf_pyg.accessor
from dnf_pyg import FilterOptions
from dnf_pyg.nn import DNFNet


@pytest.fixture
def pyvista(monkeypatch):
    """What PyVista 0.48 has of accessors, and a mesh of its kind."""
    module = ModuleType("pyvista")

    class PolyData:
        def __init__(self, points, faces):
            self.points, self.faces = points, faces

        def copy(self):
            return copy.deepcopy(self)

    def register_dataset_accessor(name, target):
        return lambda accessor: setattr(target, name, property(accessor)) or accessor

    PolyData.__module__ = "pyvista.core.pointset"
    module.PolyData, module.register_dataset_accessor = PolyData, register_dataset_accessor
    monkeypatch.setitem(sys.modules, "pyvista", module)
    yield module
    monkeypatch.undo()
    importlib.reload(dnf_pyg.accessor)


def test_mesh_gets_the_accessor_when_pyvista_loads_the_entry_point(pyvista):
    project = tomllib.loads((Path(__file__).resolve().parents[1] / "pyproject.toml").read_text())["project"]
    (entry,) = project["entry-points"]["pyvista.accessors"].items()
    assert entry == ("dnf", "dnf_pyg.accessor")
    importlib.reload(dnf_pyg.accessor)
    ball = trimesh.creation.icosphere(subdivisions=2)
    mesh = pyvista.PolyData(ball.vertices.astype(np.float32), np.insert(ball.faces, 0, 3, axis=1).ravel())
    torch.manual_seed(0)
    net = DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8)
    options = {"weights": net, "filtering": FilterOptions(patch_size=100)}
    denoised = mesh.dnf.denoise(**options)
    assert type(denoised) is pyvista.PolyData
    assert denoised.points.dtype == np.float32
    expected = dnf_pyg.denoise((ball.vertices.astype(np.float32), ball.faces), **options)
    np.testing.assert_array_equal(denoised.points, expected.mesh[0])
    np.testing.assert_array_equal(mesh.points, ball.vertices.astype(np.float32))


def test_nothing_is_registered_and_pyvista_not_imported_without_it():
    code = "import sys, dnf_pyg.accessor; sys.exit('pyvista' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
