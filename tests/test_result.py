import numpy as np
import torch
import trimesh

from dnf_pyg.mesh.noise_level import NoiseEstimate
from dnf_pyg.result import DenoiseResult


def result_of(noisy, pos, face):
    mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
    ones = torch.ones(face.size(1))
    return DenoiseResult(
        mesh, pos, face, ones[:, None], 2 * ones, ones, NoiseEstimate(0.25, 0.5), 3, 1,
        {"network": 1.5, "update": 0.25}, ["A warning <b>."], 7, "it was enough", noisy, 0.0,
    )  # fmt: skip


def test_movement_is_in_mean_edge_lengths(cube_mesh):
    noisy, face = cube_mesh
    pos = noisy.clone()
    pos[4, 1] += 0.5
    result = result_of(noisy, pos, face)
    edges = trimesh.Trimesh(noisy.numpy(), face.t().numpy(), process=False).edges_unique_length
    expected = np.zeros(len(pos))
    expected[4] = 0.5 / edges.mean()
    np.testing.assert_allclose(result.movement.numpy(), expected)
    assert result.vertices.shape == (len(pos), 3)


def test_report_holds_the_figures_and_warnings(sphere_mesh, tmp_path):
    pos, face = sphere_mesh
    result = result_of(pos, 1.01 * pos, face)
    result.report(tmp_path / "page.html", title="a & b")
    page = (tmp_path / "page.html").read_text()
    assert "<h1>a &amp; b</h1>" in page
    assert "A warning &lt;b&gt;." in page
    for (value, *_), name in zip(result.figures().values(), result.figures(), strict=True):
        assert name in page
        assert value in page
    assert result.figures()["Iterations of the vertex update"] == ("7: it was enough",)
    assert result.figures()["Time"] == ("1.8 s",)
    result.save(tmp_path / "ball.ply")
    assert len(trimesh.load(tmp_path / "ball.ply", process=False).vertices) == len(pos)
