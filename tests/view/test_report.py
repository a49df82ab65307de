import matplotlib.image
import pytest
import torch

from dnf_pyg.view.report import draw_meshes, normal_error


@pytest.fixture
def meshes(sphere_mesh):
    pos, face = sphere_mesh
    noise = torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    return {"clean": (pos, face), "noisy": (pos + 0.05 * noise, face)}


def test_normal_error_in_degrees(sphere_mesh):
    pos, face = sphere_mesh
    angle = torch.tensor(0.2)
    turn = torch.tensor([[angle.cos(), -angle.sin(), 0], [angle.sin(), angle.cos(), 0], [0, 0, 1]], dtype=pos.dtype)
    error = normal_error(pos @ turn.t(), pos, face)
    assert abs(float(error.max()) - 0.2 * 180 / torch.pi) < 0.1
    assert float(normal_error(pos, pos, face).max()) < 1e-5


def test_picture_shows_meshes_and_error_maps(tmp_path, meshes):
    draw_meshes(tmp_path / "plain.png", meshes, size=100)
    draw_meshes(tmp_path / "error.png", meshes, reference=meshes["clean"], size=100)
    plain = matplotlib.image.imread(tmp_path / "plain.png")
    error = matplotlib.image.imread(tmp_path / "error.png")
    assert error.shape[0] == 2 * plain.shape[0]
    grey = abs(plain[..., 0] - plain[..., 2]) < 0.01
    assert grey.all()
    drawn = plain[..., 0] < 0.9
    half = plain.shape[1] // 2
    assert drawn[:, :half].mean() > 0.3
    assert drawn[:, half:].mean() > 0.3
    below = error[plain.shape[0] :]
    reddish = below[..., 0] - below[..., 2] > 0.3
    assert reddish[:, half:].mean() > 0.1


def test_rejects_no_mesh(tmp_path):
    with pytest.raises(ValueError, match="at least one mesh"):
        draw_meshes(tmp_path / "none.png", {})
