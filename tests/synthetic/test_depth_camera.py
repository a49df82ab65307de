import math

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh import adjacency, geometry
from dnf_pyg.mesh.correlation import correlation_by_ring
from dnf_pyg.synthetic.depth_camera import DepthCamera, KinectFusion, KinectV1, KinectV2, StructuredLight

EYE = torch.eye(3, dtype=torch.float64)
CAMERAS = [KinectV1(), KinectV2(), KinectFusion(), StructuredLight()]


@pytest.fixture
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=5)
    return torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()


def look(camera, mesh, seed=0):
    return camera(*mesh, EYE, torch.Generator().manual_seed(seed))


@pytest.mark.parametrize("camera", CAMERAS)
def test_sees_the_front_with_an_open_boundary(camera, ball):
    view = look(camera, ball)
    assert 0.25 < view.face.size(1) / ball[1].size(1) < 0.5
    assert (geometry.face_normals(view.clean, view.face)[:, 2] < 0.05).all()
    assert adjacency.boundary_vertices(view.face, view.clean.size(0)).any()
    assert view.face.unique().numel() == view.clean.size(0)


@pytest.mark.parametrize("camera", CAMERAS)
def test_errs_along_the_viewing_ray(camera, ball):
    view = look(camera, ball)
    assert torch.linalg.cross(view.noisy, view.clean).norm(dim=1).max() < 1e-12
    error = (view.noisy - view.clean).norm(dim=1)
    assert 0.0001 < error.square().mean().sqrt() < 0.006
    assert (view.noisy[:, 2] != view.clean[:, 2]).double().mean() > 0.9
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
    torch.testing.assert_close(1000 * steps, (1000 * steps).round())
    assert KinectV2().depth_error(torch.ones(1), torch.tensor([math.radians(75)])) > 2 * KinectV2().depth_error(
        torch.ones(1), torch.zeros(1)
    )


def test_kinect_v1_depths_are_those_of_the_published_formula():
    centimetres = torch.linspace(80, 300, 500, dtype=torch.float64)
    published = 35130 / (35130 / centimetres).round()  # Barron and Malik 2013, without its noise
    torch.testing.assert_close(1000 * KinectV1().quantise(centimetres / 100), (10 * published).round())


def test_kinect_v1_noise_beyond_60_degrees():
    z, slant = torch.tensor([1.5, 1.5]), torch.tensor([0.3, 1.2])
    base = 0.0012 + 0.0019 * (1.5 - 0.4) ** 2
    expected = [base, base + 0.0001 / math.sqrt(1.5) * 1.2**2 / (math.pi / 2 - 1.2) ** 2]
    assert KinectV1().depth_error(z, slant).tolist() == pytest.approx(expected, rel=1e-6)


def test_kinect_v2_noise_in_millimetres():
    value = KinectV2().depth_error(torch.tensor([2.0]), torch.tensor([1.0]))
    grazing = 0.1 * 2**1.5 / (math.pi / 2 - 1) ** 2
    assert float(value) == pytest.approx(1e-3 * (1.5 - 0.5 * 2 + 0.3 * 4 + grazing), rel=1e-6)


def roof(spacing, distance, size=81):
    """Square pyramid before the camera, its sides aslant by 35 degrees, on a grid of vertices ``spacing`` apart."""
    row, column = torch.meshgrid(torch.arange(size), torch.arange(size), indexing="ij")
    x, y = (column - size // 2).double() * spacing, (row - size // 2).double() * spacing
    depth = distance + 0.7 * torch.maximum(x.abs(), y.abs())
    corner = (size * row + column)[:-1, :-1].flatten()
    lower, upper = [corner, corner + size, corner + 1], [corner + 1, corner + size, corner + size + 1]
    return torch.stack([x, y, depth], -1).view(-1, 3), torch.cat([torch.stack(lower), torch.stack(upper)], 1)


def errors(camera, pos, face):
    """Mean angle in degrees, root mean square in metres, correlation at one to four edges; means over 5 images."""
    angle, size, correlation = [], [], []
    for seed in range(5):
        moved = camera.measure(pos, face, torch.Generator().manual_seed(seed))
        error = (moved - pos)[:, 2]
        clean, noisy = geometry.face_normals(pos, face), geometry.face_normals(moved, face)
        angle.append(geometry.angular_difference(noisy, clean).mean())
        size.append(error.square().mean().sqrt())
        correlation.append(torch.tensor(correlation_by_ring(error, face, 4)))
    return torch.stack(angle).mean(), torch.stack(size).mean(), torch.stack(correlation).mean(0)


def test_kinect_v1_errs_as_published_and_correlates_as_measured():
    pos, face = roof(1.6 * 0.74 / 585.5, 0.7)
    angle, size, correlation = errors(KinectV1(), pos, face)
    axial = 0.0012 + 0.0019 * (pos[:, 2] - 0.4).square()
    steps = (pos[:, 2].square() / 351.3).square() / 12 + 0.001**2 / 12  # rounding to disparities, then millimetres
    assert size == pytest.approx((axial.square() + steps).mean().sqrt().item(), rel=0.1)
    assert angle == pytest.approx(26.1, abs=2)
    torch.testing.assert_close(correlation, torch.tensor([0.64, 0.44, 0.28, 0.24]), atol=0.05, rtol=0)


def test_kinect_v1_errs_as_the_measured_pair(cnr_root):
    path = cnr_root.parent / "real" / "kinect_v1_pyramid_16.npz"
    if not path.is_file():
        pytest.skip("the real scans are not beside this checkout (../shared/data/real)")
    pair = np.load(path)
    pos, face = torch.from_numpy(pair["gt"]).double() / 1000, torch.from_numpy(pair["faces"].astype(np.int64)).t()
    angle, size, correlation = errors(KinectV1(), pos, face)
    assert angle == pytest.approx(26.1, abs=1)
    assert size == pytest.approx(0.0019, abs=0.0002)
    torch.testing.assert_close(correlation, torch.tensor([0.64, 0.44, 0.28, 0.24]), atol=0.05, rtol=0)


def test_kinect_fusion_leaves_the_errors_of_long_range():
    angle, size, correlation = errors(KinectFusion(), *roof(1.6 * 0.74 / 585.5, 0.7))
    torch.testing.assert_close(correlation[:3], torch.tensor([0.96, 0.92, 0.88]), atol=0.05, rtol=0)
    assert angle < 8
    assert 0.0005 < size < 0.0012
    one, many = (errors(KinectFusion(num_views=n), *roof(0.002, 0.7))[1] for n in (1, 1000))
    assert many / one == pytest.approx(0.3**0.5, rel=0.1)


def test_structured_light_errs_as_scans_of_prints():
    angle, size, correlation = errors(StructuredLight(), *roof(0.0003, 0.39))
    torch.testing.assert_close(correlation, torch.tensor([0.82, 0.64, 0.48, 0.33]), atol=0.08, rtol=0)
    assert angle == pytest.approx(13, abs=3)
    assert size == pytest.approx(0.00016, abs=0.00004)


def test_variance_does_not_depend_on_the_parts():
    class Plain(DepthCamera):
        def depth_error(self, depth, slant):
            return torch.full_like(depth, 0.001)

    pos, face = roof(0.004, 0.7)
    for parts in ([(0.0, 2.0)], [(1.5, 1.0), (4.0, 3.0)]):
        _, size, _ = errors(Plain(1.0, 0.5, 585.5, parts), pos, face)
        assert size == pytest.approx(0.001, rel=0.12)  # interpolation between pixels takes a little


@pytest.mark.parametrize("parts", [[], [(-1.0, 1.0)], [(1.0, -1.0)]])
def test_rejects_bad_parts(parts):
    class Plain(DepthCamera):
        def depth_error(self, depth, slant):
            return depth

    with pytest.raises(ValueError, match="Expected 'parts' as pairs of numbers of at least 0"):
        Plain(1.0, 0.5, 585.5, parts)


def test_rejects_fusion_of_nothing():
    with pytest.raises(ValueError, match=r"Expected 'num_views' of at least 1 \(got 0\)"):
        KinectFusion(num_views=0)
