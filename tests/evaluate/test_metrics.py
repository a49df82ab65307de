import math

import pytest
import torch
import trimesh

from dnf_pyg.evaluate.measures import mean_angular_difference, normal_angles, vertex_errors
from dnf_pyg.evaluate.metrics import MeanAngularDifference, VertexError
from dnf_pyg.mesh.geometry import angular_difference


def test_angle_matches_arc_cosine_in_a_loop():
    generator = torch.Generator().manual_seed(0)
    a, b = torch.randn(2, 50, 3, generator=generator, dtype=torch.float64)
    for i, angle in enumerate(angular_difference(a, b).tolist()):
        cosine = float(a[i] @ b[i] / a[i].norm() / b[i].norm())
        assert angle == pytest.approx(math.degrees(math.acos(cosine)), rel=1e-6)


def test_small_angles_are_exact():
    angle = 1e-6
    a = torch.tensor([[1.0, 0.0, 0.0]], dtype=torch.float64)
    b = torch.tensor([[math.cos(angle), math.sin(angle), 0.0]], dtype=torch.float64)
    assert float(angular_difference(a, b)) == pytest.approx(math.degrees(angle), rel=1e-6)


def test_collapsed_face_counts_as_90_degrees_and_unknown_target_is_left_out():
    normal = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    clean = torch.tensor([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert float(MeanAngularDifference()(normal, clean)) == pytest.approx(45.0)


def test_theta_accumulates_over_faces_not_batches():
    metric = MeanAngularDifference()
    x, y = torch.eye(3)[:1], torch.eye(3)[1:2]
    metric.update(x, y)  # 90 degrees, one face
    metric.update(x.expand(3, 3), x.expand(3, 3))  # 0 degrees, three faces
    assert float(metric.compute()) == pytest.approx(22.5)


def test_theta_rejects_other_shapes():
    with pytest.raises(ValueError, match=r"'clean_normal' of shape \[2, 3\] \(got \[3, 3\]\)\. Pass"):
        MeanAngularDifference().update(torch.zeros(2, 3), torch.zeros(3, 3))


def test_vertex_error_of_a_shifted_plane():
    grid = trimesh.creation.box(extents=(10, 10, 1)).subdivide().subdivide()
    clean = torch.tensor(grid.vertices)
    face = torch.tensor(grid.faces).t()
    lengths = torch.tensor(grid.edges_unique_length)
    inside = clean[(clean[:, 2] == 0.5) & (clean[:, :2].abs().amax(dim=1) < 4)]
    moved = inside + torch.tensor([0.0, 0.0, 0.3])
    expected = 0.3 / float(lengths.mean())
    assert vertex_errors(moved, clean, face).tolist() == pytest.approx([expected] * len(moved), rel=1e-6)
    assert float(VertexError()(moved, clean, face)) == pytest.approx(expected, rel=1e-6)


def test_mean_of_one_mesh_is_the_metric_and_leaves_out_faces_without_clean_normal():
    generator = torch.Generator().manual_seed(0)
    normal, clean = (torch.nn.functional.normalize(torch.randn(50, 3, generator=generator), dim=1) for _ in range(2))
    clean[::7] = 0
    known = [i for i in range(50) if i % 7]
    angles = [math.degrees(math.acos(float(normal[i].double() @ clean[i].double()))) for i in known]
    assert normal_angles(normal, clean).tolist() == pytest.approx(angles, abs=1e-3)
    assert mean_angular_difference(normal, clean) == pytest.approx(sum(angles) / len(angles), abs=1e-4)
    assert mean_angular_difference(normal, clean) == pytest.approx(float(MeanAngularDifference()(normal, clean)))
