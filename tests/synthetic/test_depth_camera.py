import math

import pytest
import torch
import trimesh

from dnf_pyg.mesh import adjacency, geometry
from dnf_pyg.synthetic.depth_camera import KinectV1, KinectV2

EYE = torch.eye(3, dtype=torch.float64)


@pytest.fixture
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=5)
    return torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()


def look(camera, mesh, seed=0):
    return camera(*mesh, EYE, torch.Generator().manual_seed(seed))


@pytest.mark.parametrize("camera", [KinectV1(), KinectV2()])
def test_sees_the_front_with_an_open_boundary(camera, ball):
    view = look(camera, ball)
    assert 0.25 < view.face.size(1) / ball[1].size(1) < 0.5
    assert (geometry.face_normals(view.clean, view.face)[:, 2] < 0.05).all()
    assert adjacency.boundary_vertices(view.face, view.clean.size(0)).any()
    assert view.face.unique().numel() == view.clean.size(0)


@pytest.mark.parametrize("camera", [KinectV1(), KinectV2()])
def test_errs_along_the_viewing_ray(camera, ball):
    view = look(camera, ball)
    assert torch.linalg.cross(view.noisy, view.clean).norm(dim=1).max() < 1e-12
    error = (view.noisy - view.clean).norm(dim=1)
    assert 0.0005 < error.square().mean().sqrt() < 0.006
    torch.testing.assert_close(look(camera, ball).noisy, view.noisy, rtol=0, atol=0)
    assert not torch.equal(look(camera, ball, seed=1).noisy, view.noisy)


def test_hidden_faces_are_dropped():
    front, back = trimesh.creation.box((1, 1, 0.1)), trimesh.creation.box((0.5, 0.5, 0.1))
    back.apply_translation((0, 0, 0.8))
    parts = [part.subdivide_to_size(0.05) for part in (front, back)]
    mesh = trimesh.util.concatenate(parts)
    view = look(KinectV2(), (torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t()))
    assert view.clean[:, 2].max() < 1.0  # the smaller box stands behind the larger one


def test_kinect_v1_error_grows_with_depth_and_comes_in_steps():
    near, far = (KinectV1().depth_error(torch.tensor([z]), torch.tensor([0.0])) for z in (0.8, 2.0))
    assert far / near == pytest.approx((0.0012 + 0.0019 * 1.6**2) / (0.0012 + 0.0019 * 0.4**2))
    steps = KinectV1().quantise(torch.linspace(0.98, 1.02, 1000, dtype=torch.float64)).unique()
    assert (steps.diff().mean()).item() == pytest.approx(1 / 351.3, rel=0.1)
    assert KinectV2().depth_error(torch.ones(1), torch.tensor([math.radians(75)])) > 2 * KinectV2().depth_error(
        torch.ones(1), torch.zeros(1)
    )


def test_kinect_v1_depths_are_those_of_the_published_formula():
    centimetres = torch.linspace(80, 300, 500, dtype=torch.float64)
    published = 35130 / (35130 / centimetres).round()  # Barron and Malik 2013, without its noise
    torch.testing.assert_close(100 * KinectV1().quantise(centimetres / 100), published)


def test_kinect_v1_noise_beyond_60_degrees():
    z, slant = torch.tensor([1.5, 1.5]), torch.tensor([0.3, 1.2])
    base = 0.0012 + 0.0019 * (1.5 - 0.4) ** 2
    expected = [base, base + 0.0001 / math.sqrt(1.5) * 1.2**2 / (math.pi / 2 - 1.2) ** 2]
    assert KinectV1().depth_error(z, slant).tolist() == pytest.approx(expected, rel=1e-6)


def test_kinect_v2_noise_in_millimetres():
    value = KinectV2().depth_error(torch.tensor([2.0]), torch.tensor([1.0]))
    grazing = 0.1 * 2**1.5 / (math.pi / 2 - 1) ** 2
    assert float(value) == pytest.approx(1e-3 * (1.5 - 0.5 * 2 + 0.3 * 4 + grazing), rel=1e-6)
