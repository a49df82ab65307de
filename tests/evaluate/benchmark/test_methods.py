from functools import partial

import pytest
import torch

from dnf_pyg.errors import MeshError, MeshFileError
from dnf_pyg.evaluate.baselines import BilateralNormalFilter
from dnf_pyg.evaluate.benchmark import ClassicalMethod, NetworkMethod, OutputFolder
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh.vertex_update import update_vertices
from dnf_pyg.nn import DNFNet
from dnf_pyg.pipeline import FilterOptions, UpdateOptions, denoise


@pytest.fixture
def noisy(test_set):
    return read_mesh(test_set / "noisy" / "ball_n2.obj")


def test_network_gives_what_denoise_gives(noisy):
    torch.manual_seed(0)
    net = DNFNet(k=(3, 5, 8), residual_k=4, channels=(8, 8, 8), embedding_channels=8).eval()
    options = {"filtering": FilterOptions(seed=3), "update": UpdateOptions(num_iterations=5)}
    method = NetworkMethod("net", partial(denoise, weights=net, **options), "denoise(weights=0123)")
    result = method("ball_n2", noisy.pos, noisy.face)
    expected = denoise(noisy.mesh, net, **options)
    torch.testing.assert_close(result.pos, torch.tensor(expected.mesh.vertices))
    torch.testing.assert_close(result.normal, expected.normal)
    assert result.seconds > 0
    assert method.parameters("ball_n2") == "denoise(weights=0123)"


def test_classical_filter_moves_vertices_as_networks_do(noisy):
    update = UpdateOptions(num_iterations=7, early_stopping="always")
    method = ClassicalMethod("BNF", BilateralNormalFilter(num_iterations=2), update)
    result = method("ball_n2", noisy.pos, noisy.face)
    normal = BilateralNormalFilter(num_iterations=2)(noisy.pos, noisy.face).normal
    expected = update_vertices(noisy.pos, noisy.face, normal, 7, early_stopping=True)
    torch.testing.assert_close((result.pos, result.normal), (expected, normal))
    assert method.parameters("ball_n2") == (
        f"BilateralNormalFilter(sigma_range=0.35, num_iterations=2, num_vertex_iterations=20), {update!r}"
    )


def test_classical_filter_with_its_own_vertex_positions(noisy):
    method = ClassicalMethod("BNF", BilateralNormalFilter(num_iterations=2), update=None)
    result = method("ball_n2", noisy.pos, noisy.face)
    expected = BilateralNormalFilter(num_iterations=2)(noisy.pos, noisy.face)
    torch.testing.assert_close((result.pos, result.normal), tuple(expected))
    assert method.parameters("ball_n2") == repr(method.baseline)


def test_outputs_of_another_program(noisy, tmp_path):
    noisy.mesh.export(tmp_path / "ball_n2.ply")
    method = OutputFolder("other", tmp_path)
    result = method("ball_n2", noisy.pos, noisy.face)
    torch.testing.assert_close(result.pos.float(), noisy.pos.float())
    assert result.normal is result.seconds is None
    before = method.parameters("ball_n2")
    noisy.mesh.apply_scale(2).export(tmp_path / "ball_n2.ply")
    assert method.parameters("ball_n2") != before


def test_output_with_other_faces(noisy, test_set, tmp_path):
    (tmp_path / "ball_n2.obj").write_bytes((test_set / "noisy" / "box_n1.obj").read_bytes())
    with pytest.raises(MeshError, match=r"Expected 162 vertices and 320 faces.*\(got 26 and 48\)"):
        OutputFolder("other", tmp_path)("ball_n2", noisy.pos, noisy.face)


def test_output_that_is_missing(noisy, tmp_path):
    with pytest.raises(MeshFileError, match=r"a mesh called 'ball_n2'.*Name it like the noisy mesh\."):
        OutputFolder("other", tmp_path).parameters("ball_n2")
