import math

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.mesh.coarse import coarsen
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.mesh.noise import CorrelatedNoise, GaussianNormalNoise, RayNoise
from dnf_pyg.mesh.noise_level import estimate_noise, estimate_noise_level


def as_tensors(mesh):
    return torch.tensor(mesh.vertices, dtype=torch.float64), torch.tensor(mesh.faces).t().contiguous()


def noisy(mesh, noise, level, seed=0):
    pos, face = mesh
    return noise(pos, face, level, torch.Generator().manual_seed(seed)), face


@pytest.fixture
def fine_cube(cube_mesh):
    pos, face = cube_mesh
    return as_tensors(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False).subdivide())


@pytest.fixture
def meshes(fine_cube):
    ball, ring = trimesh.creation.icosphere(subdivisions=4), trimesh.creation.torus(2, 0.7, 96, 48)
    return {"cube": fine_cube, "sphere": as_tensors(ball), "torus": as_tensors(ring)}


@pytest.mark.parametrize("level", [0.05, 0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("shape", ["sphere", "cube"])
def test_finds_the_noise_that_was_added(shape, level, meshes):
    estimate = estimate_noise(*noisy(meshes[shape], GaussianNormalNoise(), level))
    assert estimate.level == pytest.approx(level, rel=0.15, abs=0.02)
    assert estimate.correlation == 0 or level < 0.1  # the edges of a cube stand out from weak noise


@pytest.mark.parametrize("shape", ["sphere", "torus"])
@pytest.mark.parametrize("level", [0.2, 0.4, 0.6])
def test_tells_correlated_noise_from_white(shape, level, meshes):
    noise = CorrelatedNoise([0, 2, 8], [0.1, 0.6, 0.3])
    estimate = estimate_noise(*noisy(meshes[shape], noise, level))
    assert 0.5 * level < estimate.level < 1.3 * level
    assert 0.6 < estimate.correlation <= 0.85


@pytest.mark.parametrize(("sections", "num_vertices"), [((48, 32), 1536), ((64, 40), 2560)])
def test_correlation_needs_two_thousand_vertices(sections, num_vertices):
    pos, face = as_tensors(trimesh.creation.torus(2, 0.7, *sections))
    assert len(pos) == num_vertices
    estimate = estimate_noise(*noisy((pos, face), CorrelatedNoise([0, 2, 8], [0.1, 0.6, 0.3]), 0.4))
    assert (estimate.correlation > 0.6) == (num_vertices >= 2000)
    assert (estimate.correlation == 0) == (num_vertices < 2000)


@pytest.mark.parametrize("height", [0.1, 0.3, 0.6])
def test_relief_is_not_correlated_noise(height, meshes):
    pos, face = meshes["sphere"]
    unit = float(mean_edge_length(pos, face))
    relief = torch.sin(pos * (2 * math.pi / (10 * unit))).prod(dim=1, keepdim=True)  # waves of 10 edges
    estimate = estimate_noise(pos + height * unit * relief * pos, face)
    assert estimate.level < 0.1 * height
    assert not estimate.is_correlated


@pytest.mark.parametrize("level", [0.1, 0.15])
def test_white_noise_on_relief_is_not_correlated(level, meshes):
    """Waves of 8 and 16 edges: detail that grows with its width, as on a decimated statue."""
    pos, face = meshes["sphere"]
    unit = float(mean_edge_length(pos, face))
    relief = sum(
        size * torch.sin(pos * (2 * math.pi / (wave * unit))).prod(dim=1) for wave, size in ((8, 2.0), (16, 8.0))
    )
    estimate = estimate_noise(*noisy((pos + unit * relief[:, None] * pos, face), GaussianNormalNoise(), level))
    assert not estimate.is_correlated
    assert estimate.level < 2 * level


def test_rounded_depths_do_not_count_as_flat():
    grid = trimesh.creation.box((2, 2, 0.1)).subdivide_to_size(0.05)
    noise = RayNoise([0, 2, 8], [0.1, 0.6, 0.3], camera=(0.0, 0.0, 9.0), step=0.3)
    estimate = estimate_noise(*noisy(as_tensors(grid), noise, 0.6))
    assert estimate.level > 0.25
    assert estimate.correlation > 0.6


def test_clean_meshes_have_little(fine_cube):
    assert estimate_noise_level(*fine_cube) < 0.01
    assert estimate_noise_level(*as_tensors(trimesh.creation.icosphere(subdivisions=4))) < 0.01
    assert estimate_noise_level(*as_tensors(trimesh.creation.capsule(10, 3, count=[24, 24]))) < 0.01
    assert estimate_noise_level(*as_tensors(trimesh.creation.torus(10, 3, 32, 16))) < 0.01


CAD = {
    "cube of 12 faces": trimesh.creation.box((10, 10, 10)),
    "plate of 12 faces": trimesh.creation.box((100, 100, 1)),
    "cylinder of 12 sections": trimesh.creation.cylinder(5, 100, sections=12),
    "cylinder of 64 sections": trimesh.creation.cylinder(5, 100, sections=64),
    "cone of 64 faces": trimesh.creation.cone(5, 10, sections=32),
    "tube": trimesh.creation.annulus(3, 5, 2),
}


@pytest.mark.parametrize("name", CAD)
def test_clean_facetted_meshes_have_none(name):
    assert estimate_noise(*as_tensors(CAD[name])) == (0, 0, 0)


@pytest.mark.parametrize("name", CAD)
def test_sharp_edges_of_a_coarse_mesh_do_not_count_as_noise(name):
    estimate = estimate_noise(*noisy(as_tensors(CAD[name]), GaussianNormalNoise(), 0.01))
    assert estimate.level < 0.07  # the two bands alone read up to 0.7
    assert estimate.correlation == 0


def test_subdivided_cad_models_have_little_noise():
    tube = trimesh.creation.cylinder(5, 100, sections=64).subdivide().subdivide()
    assert estimate_noise_level(*as_tensors(tube)) == 0
    assert estimate_noise_level(*noisy(as_tensors(tube), GaussianNormalNoise(), 0.01)) < 0.04


def test_does_not_depend_on_unit_place_or_turn(sphere_mesh):
    pos, face = sphere_mesh
    pos = pos + 0.02 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    level = estimate_noise_level(pos, face)
    assert estimate_noise_level(1e-4 * pos + 10, face) == pytest.approx(level, rel=1e-6)
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=pos.dtype))[0]
    assert estimate_noise_level(pos @ turn, face) == pytest.approx(level, rel=1e-6)


def test_loose_vertices_and_empty_meshes(sphere_mesh):
    pos, face = noisy(sphere_mesh, GaussianNormalNoise(), 0.2)
    lone = torch.cat([pos, pos.new_full((1000, 3), 5.0)])
    assert estimate_noise_level(lone, face) == pytest.approx(estimate_noise_level(pos, face), rel=0.1)
    assert estimate_noise(torch.zeros(3, 3), torch.tensor([[0], [1], [2]])) == (0, 0, 0)
    assert estimate_noise(torch.zeros(0, 3), torch.zeros(3, 0, dtype=torch.long)) == (0, 0, 0)
    assert estimate_noise(torch.eye(3), torch.tensor([[0], [1], [2]])) == (0, 0, 0)


def test_is_finite_for_degenerate_faces(sphere_mesh):
    pos, face = sphere_mesh
    doubled = torch.cat([face, face[:, :5], face[[0, 0, 1]][:, :5]], dim=1)
    assert all(math.isfinite(value) for value in estimate_noise(pos, doubled))


def test_finds_the_levels_of_the_benchmark(cnr_root):
    folder = cnr_root / "Synthetic" / "test" / "noisy"
    for name in ("block", "sphere", "star"):
        for number, level in enumerate((0.1, 0.2, 0.3), start=1):
            mesh = trimesh.load_mesh(folder / f"{name}_n{number}.obj", process=False, maintain_order=True)
            estimate = estimate_noise(*as_tensors(mesh))
            assert estimate.level == pytest.approx(level, rel=0.2)
            assert estimate.correlation == 0


@pytest.mark.parametrize("name", ["bumpy_torus", "bunny_hi", "chinese_lion", "kitten", "star"])
def test_clean_meshes_of_the_benchmark_have_no_correlated_noise(name, cnr_root):
    path = cnr_root / "Synthetic" / "test" / "original" / f"{name}.obj"
    estimate = estimate_noise(*as_tensors(trimesh.load_mesh(path, process=False, maintain_order=True)))
    assert estimate.level < 0.03
    assert not estimate.is_correlated


def test_finds_that_the_noise_of_real_scans_is_correlated(cnr_root):
    scans = {path.stem: np.load(path) for path in (cnr_root.parent / "real").glob("*.npz")}
    pairs = {name: scan for name, scan in scans.items() if "gt" in scan.files}
    if not pairs:
        pytest.skip("the real scans are not beside this checkout (../shared/data/real)")
    for name, scan in pairs.items():
        face = torch.from_numpy(scan["faces"].astype(np.int64)).t()
        estimate = estimate_noise(torch.from_numpy(scan["k1"]), face)
        is_scan = name != "print_nut"  # whose coarse surface reads like that of a decimated statue
        assert (name, estimate.is_correlated, estimate.correlation > 0.5) == (name, is_scan, is_scan)


@pytest.mark.parametrize("name", ["Julius", "boot", "bunny", "elephant", "lionstatue"])
@pytest.mark.parametrize("num_faces", [2000, 5000, 12000])
def test_decimated_statues_are_clean(name, num_faces, cnr_root):
    path = cnr_root / "Synthetic" / "train" / "original" / f"{name}.obj"
    pos, face = as_tensors(trimesh.load_mesh(path, process=False, maintain_order=True))
    coarse = coarsen(pos, face, num_faces / face.size(1))
    clean = estimate_noise(coarse.pos, coarse.face)
    assert clean.level < 0.04
    assert clean.share < 0.5
    noisy_estimate = estimate_noise(*noisy(coarse[:2], GaussianNormalNoise(), 0.3))
    assert noisy_estimate.level == pytest.approx(0.3, rel=0.3)
    assert not noisy_estimate.is_correlated
