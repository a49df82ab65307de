import pytest
import torch
import trimesh

from dnf_pyg.mesh import geometry
from dnf_pyg.mesh.noise_level import estimate_noise
from dnf_pyg.synthetic.shapes.coarse import coarse
from dnf_pyg.synthetic.shapes.dice import Dice


def make(seed, num_faces):
    return coarse(Dice(torch.Generator().manual_seed(seed)), num_faces)


@pytest.mark.parametrize("num_faces", [12, 200, 1200])
@pytest.mark.parametrize("seed", range(6))
def test_bodies_are_closed_and_of_the_wanted_size(seed, num_faces):
    pos, face = make(seed, num_faces)
    mesh = trimesh.Trimesh(pos, face.t(), process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert geometry.face_areas(pos, face).min() > 0
    assert face.size(1) == pytest.approx(num_faces, rel=0.15, abs=24)
    assert torch.equal(make(seed, num_faces)[0], pos)


def test_triangles_are_long_and_edges_sharp():
    longest = []
    for seed in range(20):
        pos, face = make(seed, 400)
        length = (pos[face] - pos[face.roll(1, 0)]).norm(dim=2)
        longest.append(float((length.amax(0) / length.amin(0)).median()))
        angle = trimesh.Trimesh(pos, face.t(), process=False).face_adjacency_angles
        assert (angle > 0.3).any()
    assert sum(ratio > 5 for ratio in longest) > 12


@pytest.mark.parametrize("seed", range(6))
def test_clean_bodies_are_not_noisy(seed):
    assert estimate_noise(*make(seed, 400)).level < 0.05
