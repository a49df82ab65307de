import pytest
import torch

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh import validate_mesh

POS = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACE = torch.tensor([[0], [1], [2]])


def test_accepts_one_triangle():
    validate_mesh(POS, FACE)
    validate_mesh(POS.double(), FACE)


@pytest.mark.parametrize("pos", [POS.long(), POS[0], POS[:, :2]])
def test_rejects_wrong_positions(pos):
    with pytest.raises(ValueError, match=r"Expected 'pos' of shape \[num_vertices, 3\] and a float dtype \(got "):
        validate_mesh(pos, FACE)


@pytest.mark.parametrize("face", [FACE.int(), FACE.t(), FACE[:2]])
def test_rejects_wrong_faces(face):
    with pytest.raises(ValueError, match=r"Expected 'face' of shape \[3, num_faces\] and int64 \(got "):
        validate_mesh(POS, face)


def test_rejects_mesh_without_faces():
    with pytest.raises(MeshError, match=r"Expected a mesh with faces \(got 3 vertices, 0 faces\)"):
        validate_mesh(POS, torch.empty(3, 0, dtype=torch.long))
    with pytest.raises(MeshError, match=r"got 0 vertices, 0 faces"):
        validate_mesh(torch.empty(0, 3), torch.empty(3, 0, dtype=torch.long))


@pytest.mark.parametrize("vertex", [-1, 3])
def test_rejects_vertices_that_do_not_exist(vertex):
    face = torch.tensor([[0, 0], [1, 1], [2, vertex]])
    with pytest.raises(MeshError, match=rf"from 0 to 2 in every face \(got {vertex} in face 1\)"):
        validate_mesh(POS, face)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1e31])
def test_rejects_coordinates_that_are_not_finite(value):
    pos = POS.double().clone()
    pos[1, 2] = value
    with pytest.raises(MeshError, match=r"Expected finite coordinates .* at vertex 1, 1 such vertices\)"):
        validate_mesh(pos, FACE)


@pytest.mark.parametrize("size", [1e-99, 1e-101, 5e-324, 0.0])
def test_rejects_sizes_whose_squares_vanish(size):
    pos = torch.cat([1.0 + 0 * POS, size * POS.double()])  # vertices without a face do not count
    if 0 < size < 1e-100:
        with pytest.raises(MeshError, match=rf"extent of at least 1e-100 \(got {size:g}\)\. Scale it up"):
            validate_mesh(pos, FACE + 3)
    else:
        validate_mesh(pos, FACE + 3)
