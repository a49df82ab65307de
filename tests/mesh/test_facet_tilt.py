import numpy as np
import pytest
import torch
import trimesh
from torch.nn.functional import normalize

from dnf_pyg.mesh import Topology, face_normals
from dnf_pyg.mesh.facet_tilt import face_rings, fit_to_triangulation, tilts


def shaken(pos, amount, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return pos + amount * torch.randn(pos.shape, generator=generator, dtype=pos.dtype)


def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4)
    return normalize(shaken(torch.tensor(mesh.vertices), 0.01), dim=1), torch.tensor(mesh.faces).t()


def tube():
    """A cylinder along z, open at both ends."""
    turn, height = torch.meshgrid(torch.arange(60), torch.arange(30), indexing="ij")
    corner = (30 * turn + height)[:, :-1].flatten()
    beside = (30 * ((turn + 1) % 60) + height)[:, :-1].flatten()
    face = torch.cat([torch.stack([corner, beside, corner + 1]), torch.stack([beside, beside + 1, corner + 1])], dim=1)
    place = shaken(torch.stack([turn.flatten(), height.flatten()], dim=1).double(), 0.15)
    angle = place[:, 0] * (2 * torch.pi / 60)
    return torch.stack([angle.cos(), angle.sin(), 0.1 * place[:, 1]], dim=1), face


def even_weights(rings):
    """The same weight for a face and each of its ring."""
    own = 1 / (1 + np.diff(rings.ptr))
    return own, np.repeat(own, np.diff(rings.ptr))


@pytest.mark.parametrize("surface", [ball, tube])
def test_tilt_is_the_difference_of_a_facet_from_the_surface(surface):
    pos, face = surface()
    topology = Topology(face, len(pos))
    rings, facet = face_rings(pos, topology), face_normals(pos, face)
    flat = torch.tensor([1.0, 1, 1 if surface is ball else 0])  # the radius of a tube is orthogonal to its axis
    smooth = normalize(pos[face].mean(dim=0) * flat, dim=1)
    found = torch.from_numpy(tilts(smooth.numpy(), rings, even_weights(rings)[1]))
    assert (smooth * found).sum(dim=1).abs().max() < 1e-12
    left = (normalize(smooth + found, dim=1) - facet).norm(dim=1)
    assert left.mean() < 0.12 * (smooth - facet).norm(dim=1).mean()


def test_tilt_is_zero_on_planes_and_without_extent():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 2, 0]], dtype=torch.float64)
    topology = Topology(torch.tensor([[0, 1], [1, 3], [2, 2]]), 4)
    normal = np.array([[0.0, 0, 1], [0, 0, 1]])
    assert abs(tilts(normal, face_rings(pos, topology), np.full(2, 0.5))).max() == 0
    bent = np.array([[0.0, 0, 1], [0.6, 0, 0.8]])
    assert abs(tilts(bent, face_rings(pos, topology), np.full(2, 0.5))).max() > 0
    assert abs(tilts(bent, face_rings(0 * pos, topology), np.full(2, 0.5))).max() == 0


def test_tilts_are_limited():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 2, 0]], dtype=torch.float64)
    rings = face_rings(pos, Topology(torch.tensor([[0, 1], [1, 3], [2, 2]]), 4))
    opposite = np.array([[0.0, 0, 1], [1, 0, 0]])
    assert np.linalg.norm(tilts(opposite, rings, np.full(2, 0.5)), axis=1).max() <= 0.3 + 1e-12


def test_means_keep_what_varies_linearly():
    row, column = torch.meshgrid(torch.arange(21), torch.arange(21), indexing="ij")
    pos = shaken(torch.stack([row.flatten(), column.flatten()], dim=1).double(), 0.15)
    pos = torch.nn.functional.pad(pos, (0, 1))
    corner = (21 * row + column)[:-1, :-1].flatten()
    face = torch.cat(
        [torch.stack([corner, corner + 21, corner + 1]), torch.stack([corner + 21, corner + 22, corner + 1])], dim=1
    )
    rings = face_rings(pos, Topology(face, len(pos)))
    own, weight = even_weights(rings)
    normal = np.tile([0.0, 0.0, 1.0], (face.size(1), 1))
    field = rings.center @ np.array([[1.0, 2, 0], [3, -1, 0], [0, 0, 0]])

    row = np.repeat(np.arange(len(own)), np.diff(rings.ptr))

    def error():
        means = own[:, None] * field
        np.add.at(means, row, weight[:, None] * field[rings.neighbor])
        inside = (abs(rings.center[:, :2] - 10) < 8).all(axis=1)
        return abs(means - field)[inside].mean()

    before = error()
    fit_to_triangulation(normal, rings, own, weight)
    assert error() < 0.01 * before
    sums = own + np.bincount(row, weight)
    np.testing.assert_allclose(sums, 1)
    assert weight.min() >= 0
