import pytest
import torch
import trimesh

from dnf_pyg.mesh import geometry
from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.sheets import thin


def make(seed, num_faces=1200):
    return thin(Dice(torch.Generator().manual_seed(seed)), num_faces)


@pytest.mark.parametrize("seed", range(8))
def test_sheets_are_closed_and_of_the_wanted_size(seed):
    pos, face = make(seed)
    mesh = trimesh.Trimesh(pos, face.t(), process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert geometry.face_areas(pos, face).min() > 0
    assert face.size(1) == pytest.approx(1200, rel=0.25)
    assert torch.equal(make(seed)[0], pos)


@pytest.mark.parametrize("seed", range(8))
def test_thickness_is_one_to_three_edges(seed):
    pos, face = make(seed)
    top, bottom = pos.chunk(2)
    thickness = (top - bottom).norm(dim=1) / geometry.mean_edge_length(pos, face)
    assert thickness.min() > 0.6
    assert thickness.max() < 3.2
    assert thickness.std() < 1e-6
