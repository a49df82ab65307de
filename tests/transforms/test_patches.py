import torch
from torch_geometric.data import Data
from torch_geometric.transforms import Compose

from dnf_pyg.mesh import HeatGrowth, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.patches import FaceFeatures, PatchExtractor, PatchOptions, patch_to_data
from dnf_pyg.transforms import AddNoise, CutPatches, JitterNormal, RandomRotation

SMALL = PatchOptions(num_patches=4, patch_size=50, k=8)


def test_patches_are_those_of_the_extractor(cube_mesh):
    pos, face = cube_mesh
    batch = CutPatches(SMALL, torch.Generator().manual_seed(0))(Data(pos=pos, face=face))
    assert batch.num_graphs == 4
    extractor, features = PatchExtractor(pos, face, patch_size=50, k=8), FaceFeatures.from_mesh(pos, face)
    seeds = [int(batch[row].face_id[0]) for row in range(4)]
    assert len(set(seeds)) == 4
    for row, seed in enumerate(seeds):
        expected = patch_to_data(extractor.extract(seed), features)
        assert batch[row].keys() == expected.keys()
        for name in expected.keys():  # noqa: SIM118 (a Data is no mapping)
            assert torch.equal(batch[row][name], expected[name])


def test_generator_decides(cube_mesh):
    mesh = Data(pos=cube_mesh[0], face=cube_mesh[1])
    one, two, other = (CutPatches(SMALL, torch.Generator().manual_seed(seed))(mesh).face_id for seed in (0, 0, 1))
    assert torch.equal(one, two)
    assert not torch.equal(one, other)


def test_noisy_patches_with_clean_targets(sphere_mesh):
    pos, face = sphere_mesh
    steps = [AddNoise(GaussianNormalNoise(), 0.2, 0.2), CutPatches(SMALL), RandomRotation(), JitterNormal()]
    batch = Compose(steps[:2])(Data(pos=pos, face=face))
    torch.testing.assert_close(batch.y, face_normals(pos, face)[batch.face_id].float())
    assert not torch.allclose(batch.x, batch.y, atol=0.1)
    batch = Compose(steps)(Data(pos=pos, face=face))
    torch.testing.assert_close(batch.x.norm(dim=1), torch.ones(200))


def test_growth(sphere_mesh):
    batch = CutPatches(PatchOptions(2, 40, 8, HeatGrowth()))(Data(pos=sphere_mesh[0], face=sphere_mesh[1]))
    assert batch.num_nodes == 80


def test_repr():
    expected = "CutPatches(PatchOptions(num_patches=4, patch_size=50, k=8, growth=None, seed=0))"
    assert str(CutPatches(SMALL)) == expected
