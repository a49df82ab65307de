"""No mesh is worse afterwards: families of clean and noisy meshes, denoised with the packaged weights."""

import warnings

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg import UpdateOptions, denoise
from dnf_pyg.mesh import edges, face_normals, vertex_normals
from dnf_pyg.mesh.geometry import angular_difference, edge_lengths
from dnf_pyg.weights.load import load_cascade

create = trimesh.creation


@pytest.fixture(scope="module")
def best():
    return load_cascade("best")


def extrusion(corners, height):
    """Prism over a polygon that is seen whole from its mean, of four faces a side."""
    num = len(corners)
    flat = np.array([*corners, np.mean(corners, axis=0)])
    pos = np.concatenate([np.insert(flat, 2, z, axis=1) for z in (0, height)])
    one = np.arange(num)
    two = (one + 1) % num
    bottom, top = np.full(num, num), num + 1
    faces = [
        [one, two, two + top],
        [one, two + top, one + top],
        [bottom, two, one],
        [bottom + top, one + top, two + top],
    ]
    return trimesh.Trimesh(pos, np.concatenate([np.stack(face, axis=1) for face in faces]), process=False)


def star(num, height):
    angle = np.arange(2 * num) * np.pi / num
    radius = np.where(np.arange(2 * num) % 2, 2.0, 1.0)
    return extrusion(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1), height)


def fan(num):
    angle = np.arange(num) * 2 * np.pi / num
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    one = np.arange(num) + 1
    return trimesh.Trimesh([[0, 0, 0], *rim], np.stack([0 * one, one, one % num + 1], axis=1), process=False)


def stairs(num, radius):
    """Surface of the voxels of a ball: what marching cubes make of a mask, without the cut edges."""
    inside = (np.square(np.mgrid[:num, :num, :num] - (num - 1) / 2).sum(axis=0)) < radius**2
    squares = []
    for axis in range(3):
        u, v, w = (np.eye(3)[(axis + turn) % 3] / 2 for turn in range(3))
        for side in (1, -1):
            middle = np.argwhere(inside & ~np.roll(inside, -side, axis)) + side * u
            squares.append(np.stack([middle - v - w, middle + v - w, middle + v + w, middle - v + w][::side], axis=1))
    pos, corner = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    square = corner.reshape(-1, 4)
    return trimesh.Trimesh(pos, np.concatenate([square[:, :3], square[:, [0, 2, 3]]]), process=False)


def fine(mesh, times):
    return mesh if times == 0 else fine(mesh.subdivide(), times - 1)


CYLINDERS = {f"cylinder of {num} sections": create.cylinder(5, 100, sections=num) for num in (12, 32, 64)}
MESHES = CYLINDERS | {
    "cube": create.box((10, 10, 10)),
    "plate": create.box((100, 100, 1)),
    "cone": create.cone(5, 10, sections=32),
    "torus": create.torus(10, 3, 32, 16),
    "capsule": create.capsule(10, 3, count=[24, 24]),
    "coarse torus": create.torus(10, 3, 16, 8),
    "coarse capsule": create.capsule(10, 3, count=[8, 8]),
    "sphere of 80 faces": create.icosphere(subdivisions=1),
    "sphere of 320 faces": create.icosphere(subdivisions=2),
    "sphere of 1280 faces": create.icosphere(subdivisions=3),
    "tube": create.annulus(3, 5, 2),
    "fan of 8": fan(8),
    "fan of 64": fan(64),
    "star": star(5, 2),
    "L": extrusion([(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)], 2),
    "stairs": stairs(14, 5.3),
    "two close sheets": create.box((10, 10, 0.1)).subdivide_to_size(1.5),
}
MESHES |= {f"prism of {num} sides": create.cylinder(3, 8, sections=num) for num in (3, 5, 6, 8)}
MESHES |= {f"box, divided {times} times": fine(create.box((4, 2, 1)), times) for times in (1, 2, 3)}
MESHES |= {f"fine {name}": fine(MESHES[name], 2) for name in ("cone", "star", "L", "tube", "prism of 6 sides")}


def tensors(name):
    mesh = MESHES[name]
    return torch.tensor(mesh.vertices, dtype=torch.float64), torch.tensor(mesh.faces).t().contiguous()


def shortest_edges(pos, face):
    """Length of the shortest edge at each vertex, (V,)."""
    edge = edges(face)
    shortest = torch.full((len(pos),), torch.inf, dtype=torch.float64)
    for end in edge:
        shortest.scatter_reduce_(0, end, edge_lengths(pos, edge), "amin")
    return shortest


def denoised(pos, face, net):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return denoise((pos.numpy(), face.t().numpy()), net)


def theta(pos, clean, face):
    return float(angular_difference(face_normals(pos, face), face_normals(clean, face)).double().mean())


@pytest.mark.parametrize("name", MESHES)
def test_clean_mesh_stays(name, best):
    pos, face = tensors(name)
    result = denoised(pos, face, best)
    assert theta(result.pos, pos, face) < 0.3
    assert ((result.pos - pos).norm(dim=1) / shortest_edges(pos, face)).max() < 0.05
    mesh = MESHES[name]
    if mesh.is_volume:
        assert trimesh.Trimesh(result.vertices, mesh.faces, process=False).volume == pytest.approx(
            mesh.volume, rel=5e-3
        )
    assert result.left_alone > 0.99
    assert any("of the mesh stays as it is" in text for text in result.warnings)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.25])
@pytest.mark.parametrize("name", MESHES)
def test_noisy_mesh_is_not_worse(name, share, best):
    clean, face = tensors(name)
    noise = torch.randn(len(clean), 1, generator=torch.Generator().manual_seed(1), dtype=clean.dtype)
    noisy = clean + share * shortest_edges(clean, face).median() * noise * vertex_normals(clean, face)
    assert theta(denoised(noisy, face, best).pos, clean, face) <= theta(noisy, clean, face) + 0.3


@pytest.mark.parametrize("size", [10, 14, 20])
@pytest.mark.parametrize("share", [0.2, 0.3, 0.4])
def test_stairs_keep_their_steps(share, size, best):
    mesh = stairs(size, 0.42 * size)
    clean, face = torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t()
    noise = torch.randn(len(clean), 1, generator=torch.Generator().manual_seed(1), dtype=clean.dtype)
    noisy = clean + share * noise * vertex_normals(clean, face)
    assert torch.equal(denoised(noisy, face, best).pos, noisy)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("sections", "sigma", "at_most"),
    [(64, 0.05, 0.9), (64, 0.1, 0.8), (96, 0.05, 0.9), (128, 0.05, 0.9), (128, 0.1, 0.9)],
)
def test_noise_of_a_cylinder_with_long_triangles(sections, sigma, at_most, seed, best):
    """Triangles 100 long and 0.25 to 0.5 wide: normals off by 1 degree move their ends by ten times the noise."""
    mesh = create.cylinder(5, 100, sections=sections)
    clean, face = torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t()
    noisy = clean + sigma * torch.randn(clean.shape, generator=torch.Generator().manual_seed(seed), dtype=clean.dtype)
    result = denoised(noisy, face, best)
    assert theta(result.pos, clean, face) < at_most * theta(noisy, clean, face)
    assert (result.pos - noisy).norm(dim=1).max() < 33 * sigma  # of an estimate that is up to a tenth too large


def test_limits_can_be_lifted(best):
    pos, face = tensors("stairs")
    smoothed = denoise((pos.numpy(), face.t().numpy()), best, update=UpdateOptions(max_excess=float("inf")))
    assert smoothed.left_alone == 0
    assert theta(smoothed.pos, pos, face) > 10


def test_noise_beside_a_clean_part_is_removed(best):
    mesh = create.torus(10, 3, 64, 32)
    pos, face = torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t()
    noise = torch.randn(len(pos), 1, generator=torch.Generator().manual_seed(1), dtype=pos.dtype)
    noisy = torch.where(pos[:, :1] > 0, pos + 0.1 * noise * vertex_normals(pos, face), pos)
    result = denoised(noisy, face, best)
    assert theta(result.pos, pos, face) < 0.3 * theta(noisy, pos, face)
    assert torch.equal(result.pos[pos[:, 0] < -5], pos[pos[:, 0] < -5])
