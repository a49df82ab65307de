import pytest
import torch
from torch_geometric.data import Data

from dnf_pyg.mesh import mean_edge_length
from dnf_pyg.mesh.noise import GaussianNoise, GaussianNormalNoise
from dnf_pyg.transforms import AddNoise


def test_adds_the_noise_of_the_model_and_keeps_the_clean_mesh(sphere_mesh):
    pos, face = sphere_mesh
    data = AddNoise(GaussianNormalNoise(), 0.2, 0.2, torch.Generator().manual_seed(1))(Data(pos=pos, face=face))
    generator = torch.Generator().manual_seed(1)
    torch.rand((), generator=generator)
    assert torch.equal(data.pos, GaussianNormalNoise()(pos, face, 0.2, generator))
    assert torch.equal(data.clean_pos, pos)


def test_level_is_drawn_from_its_range(sphere_mesh):
    pos, face = sphere_mesh
    transform = AddNoise(GaussianNoise(), 0.1, 0.5, torch.Generator().manual_seed(0))
    moved = torch.stack([transform(Data(pos=pos, face=face)).pos for _ in range(30)])
    level = (moved - pos).std(dim=(1, 2)) / mean_edge_length(pos, face)
    assert 0.09 < level.min() < 0.2
    assert 0.4 < level.max() < 0.55


def test_input_stays(sphere_mesh):
    data = Data(pos=sphere_mesh[0].clone(), face=sphere_mesh[1])
    AddNoise(GaussianNoise(), 0.1, 0.2)(data)
    assert torch.equal(data.pos, sphere_mesh[0])
    assert "clean_pos" not in data


def test_repr():
    assert str(AddNoise(GaussianNoise(), 0.1, 0.2)).endswith(", low=0.1, high=0.2)")
    assert "GaussianNoise" in str(AddNoise(GaussianNoise(), 0.1, 0.2))


@pytest.mark.parametrize("levels", [(0.3, 0.1), (-0.1, 0.2)])
def test_rejects_levels(levels):
    with pytest.raises(ValueError, match=r"0 <= 'low' <= 'high' \(got .*\). Put the smaller level first"):
        AddNoise(GaussianNoise(), *levels)
