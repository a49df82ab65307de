import pytest
import torch
import trimesh

from dnf_pyg.mesh import HeatGrowth, face_normals, one_ring
from dnf_pyg.patches import AnisotropicSeeds, PatchExtractor, cover


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4)  # 5,120 faces
    return torch.tensor(mesh.vertices), torch.tensor(mesh.faces).t().contiguous()


def coverage(patches, num_faces):
    count = torch.zeros(num_faces, dtype=torch.long)
    for patch in patches:
        count[patch.face_id] += 1
    return count


@pytest.mark.parametrize("seeds", [AnisotropicSeeds(), AnisotropicSeeds(floor=100.0)], ids=repr)
def test_seeds_are_distinct_and_repeatable(cube_mesh, seeds):
    pos, face = cube_mesh
    normal = face_normals(pos, face)
    drawn = seeds(normal, face, 100, generator())
    assert len(drawn.unique()) == 100
    assert torch.equal(drawn, seeds(normal, face, 100, generator()))
    assert not torch.equal(drawn, seeds(normal, face, 100, generator(1)))
    assert seeds(normal, face, 0).shape == (0,)


@pytest.mark.parametrize("seeds", [AnisotropicSeeds(), AnisotropicSeeds(floor=100.0)], ids=repr)
def test_more_seeds_than_faces_repeat(cube_mesh, seeds):
    pos, face = cube_mesh
    drawn = seeds(face_normals(pos, face), face, 2 * 768 + 5, generator())
    assert torch.bincount(drawn, minlength=768).tolist().count(3) == 5
    assert torch.bincount(drawn, minlength=768).min() == 2


def test_variation_matches_loop(sphere_mesh):
    pos, face = sphere_mesh
    normal = face_normals(pos, face)
    neighbor, centre = one_ring(face, len(pos))
    variation = torch.stack([(1 - normal[neighbor[centre == f]] @ normal[f]).mean() for f in range(face.size(1))])
    torch.testing.assert_close(AnisotropicSeeds(0.5).weight(normal, face), variation + 0.5 * variation.mean())


def test_edges_of_a_cube_are_preferred(cube_mesh):
    pos, face = cube_mesh
    normal = face_normals(pos, face)
    weight = AnisotropicSeeds().weight(normal, face)
    at_edge = weight > weight.min()
    assert 0.3 < at_edge.double().mean() < 0.7
    drawn = torch.cat([AnisotropicSeeds()(normal, face, 50, generator(i)) for i in range(20)])
    assert at_edge[drawn].double().mean() > 0.85
    assert (~at_edge[drawn]).any()


def test_flat_mesh_is_sampled_evenly():
    face = torch.tensor([[0, 1], [1, 3], [2, 2]])
    assert AnisotropicSeeds().weight(torch.tensor([[0.0, 0, 1], [0, 0, 1]]), face).tolist() == [1, 1]


def test_rejects_floor():
    with pytest.raises(ValueError, match=r"Expected 'floor' above 0 \(got 0\)"):
        AnisotropicSeeds(floor=0)


@pytest.mark.parametrize("min_coverage", [1, 2, 3])
def test_cover_is_complete_with_few_patches(ball, min_coverage):
    extractor = PatchExtractor(*ball, patch_size=100, k=5)
    patches = list(cover(extractor, min_coverage, generator()))
    assert coverage(patches, 5120).min() >= min_coverage
    assert len(patches) * 100 / 5120 < 1.75 * min_coverage  # overlap; discs in the plane cannot do better than 1.21


def test_cover_is_repeatable(ball):
    extractor = PatchExtractor(*ball, patch_size=300, k=5)
    one, two, other = ([int(p.face_id[0]) for p in cover(extractor, 2, generator(s))] for s in (3, 3, 4))
    assert one == two
    assert one != other


def test_cover_with_heat_growth(ball):
    extractor = PatchExtractor(*ball, HeatGrowth(), patch_size=400, k=5)
    patches = list(cover(extractor, 2, generator()))
    assert coverage(patches, 5120).min() >= 2


def test_cover_of_components(ball, sphere_mesh):
    pos, face = ball
    small = torch.tensor([[0], [1], [2]]) + len(pos)
    both = torch.cat([face, small, small + 3], dim=1)
    where = torch.cat([pos, pos[:3] + 5, pos[:3] - 5])
    patches = list(cover(PatchExtractor(where, both, patch_size=400, k=5), 2, generator()))
    count = coverage(patches, both.size(1))
    assert count.min() >= 2
    assert count[-2:].tolist() == [2, 2]


def test_mesh_smaller_than_a_patch(sphere_mesh):
    patches = list(cover(PatchExtractor(*sphere_mesh, patch_size=800, k=5), 2, generator()))
    assert [len(p.face_id) for p in patches] == [320, 320]
    exact = list(cover(PatchExtractor(*sphere_mesh, patch_size=320, k=5), 1, generator()))
    assert [len(p.face_id) for p in exact] == [320]


def test_rejects_min_coverage(sphere_mesh):
    with pytest.raises(ValueError, match=r"Expected 'min_coverage' of at least 1 \(got 0\)"):
        next(cover(PatchExtractor(*sphere_mesh), 0))
