import math
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from torch_geometric.loader import DataLoader

from dnf_pyg.datasets import FreshPatchDataset, PatchDataset
from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import HeatGrowth, face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.patches import FaceFeatures, PatchExtractor, PatchOptions, patch_to_data

SMALL = PatchOptions(num_patches=6, patch_size=100, k=10)
BOTH = pytest.mark.parametrize("dataset", [PatchDataset, FreshPatchDataset])


def angle(one, other):
    """Mean angle in degrees."""
    return math.degrees((one * other).sum(dim=1).clamp(-1, 1).acos().mean())


@pytest.fixture
def pair(tmp_path):
    clean = trimesh.creation.icosphere(subdivisions=3)
    noisy = clean.copy()
    noisy.vertices += np.random.default_rng(0).normal(scale=0.01, size=noisy.vertices.shape)
    paths = tmp_path / "noisy.ply", tmp_path / "clean.ply"
    for mesh, path in zip((noisy, clean), paths, strict=True):
        mesh.export(path)
    return paths


def folders(root):
    return sorted(path.name for path in (root / "processed").iterdir() if path.is_dir())


def test_pair_matches_patches_cut_by_hand(pair, tmp_path):
    dataset = PatchDataset(tmp_path, [pair], SMALL)
    assert len(dataset) == 6
    noisy, clean = map(read_mesh, pair)
    extractor = PatchExtractor(noisy.pos, noisy.face, patch_size=100, k=10)
    features, clean_normal = FaceFeatures.from_mesh(noisy.pos, noisy.face), face_normals(clean.pos, clean.face)
    for data in dataset:
        expected = patch_to_data(extractor.extract(int(data.face_id[0])), features, clean_normal)
        assert set(data.keys()) == set(expected.keys())
        for name in ("x", "y", "face_id", "distance", "edge_index", "edge_attr", "seed_index"):
            assert torch.equal(data[name], expected[name])
        torch.testing.assert_close(data.pos, expected.pos, atol=1e-6, rtol=1e-5)
        torch.testing.assert_close(data.area, expected.area, atol=1e-6, rtol=1e-5)


@BOTH
def test_batches(pair, tmp_path, dataset):
    batch = next(iter(DataLoader(dataset(tmp_path, [pair], SMALL), batch_size=4)))
    assert batch.num_nodes == 400
    assert batch.edge_index.shape == (2, 4000)
    assert batch.x.dtype == batch.y.dtype == torch.float32
    torch.testing.assert_close(batch.x.norm(dim=1), torch.ones(400))
    assert 1 < angle(batch.x, batch.y) < 30


def test_fresh_patches_of_a_pair_are_those_of_the_noisy_mesh(pair, tmp_path):
    noisy = read_mesh(pair[0])
    extractor = PatchExtractor(noisy.pos, noisy.face, patch_size=100, k=10)
    normal = face_normals(noisy.pos, noisy.face).float()
    for data in FreshPatchDataset(tmp_path, [pair], SMALL):
        expected = extractor.extract(int(data.face_id[0]))
        assert len(np.intersect1d(data.face_id, expected.face_id)) >= 99  # a tie at the rim may fall otherwise
        torch.testing.assert_close(data.x, normal[data.face_id], atol=1e-4, rtol=0)


@BOTH
def test_noise_is_drawn_afresh_at_its_level(pair, tmp_path, dataset):
    torch.manual_seed(0)
    options = {"patches": SMALL, "noise": GaussianNormalNoise()}
    low = dataset(tmp_path, [(None, pair[1])], noise_level=(0.0, 0.0), **options)
    item = low[0]
    assert angle(item.x, item.y) < 0.1
    high = dataset(tmp_path, [(None, pair[1])], noise_level=(0.3, 0.3), **options)
    assert 20 < np.mean([angle(data.x, data.y) for data in high]) < 35  # 29 degrees on whole meshes
    assert not torch.equal(high[0].x, high[0].x)


def test_noise_of_a_patch_is_that_of_the_mesh(pair, tmp_path):
    class Ramp:
        """Moves by an amount that only depends on the place: the same on a patch as on the mesh."""

        def __call__(self, pos, face, level, generator=None):
            return pos + 0.5 * torch.sin(7 * pos).roll(1, dims=1)

    dataset = PatchDataset(tmp_path, [(None, pair[1])], SMALL, noise=Ramp())
    clean = read_mesh(pair[1])
    entry = dataset._entry(0)
    whole = face_normals(Ramp()(torch.from_numpy(entry["pos"].copy()), clean.face, 1.0), clean.face)
    for data in dataset:
        torch.testing.assert_close(data.x, whole[data.face_id], atol=1e-5, rtol=0)


@BOTH
def test_noise_seed_repeats_each_item(pair, tmp_path, dataset):
    options = {"patches": SMALL, "noise": GaussianNormalNoise(), "noise_seed": 3}
    one, two = (dataset(tmp_path, [(None, pair[1])], **options) for _ in range(2))
    for i in range(6):
        assert torch.equal(one[i].x, two[i].x)
        assert torch.equal(one[i].face_id, two[i].face_id)
    assert not torch.equal(one[0].x, one[1].x)


def test_fresh_seeds_differ(pair, tmp_path):
    dataset = FreshPatchDataset(tmp_path, [pair], SMALL)
    assert len({int(dataset[0].face_id[0]) for _ in range(20)}) > 15


def test_cache_is_kept_and_named_by_what_shapes_it(pair, tmp_path):
    def build(transform=None, **changes):
        PatchDataset(tmp_path, [pair], replace(SMALL, **changes), transform)
        return len(folders(tmp_path))

    assert build() == 1
    marked = next((tmp_path / "processed").glob("noisy-*"))
    (marked / "mark").touch()
    assert build() == 1
    assert (marked / "mark").exists()
    assert build(transform=lambda data: data) == 1  # applied when served
    changes = [{"num_patches": 5}, {"patch_size": 90}, {"k": 9}, {"seed": 1}]
    for number, change in enumerate([*changes, {"growth": HeatGrowth()}], start=2):
        assert build(**change) == number
    pair[0].write_bytes(pair[1].read_bytes())
    assert build() == 7


def test_interrupted_preparation_leaves_nothing_half_done(pair, tmp_path, monkeypatch):
    def fail(*args, **kwargs):
        raise OSError("No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(np, "save", fail)
        with pytest.raises(OSError, match="No space"):
            PatchDataset(tmp_path, [pair], SMALL)
    assert folders(tmp_path) == []
    assert len(PatchDataset(tmp_path, [pair], SMALL)) == 6


@BOTH
def test_workers_and_pickle_do_not_carry_the_arrays(pair, tmp_path, dataset):
    data = dataset(tmp_path, [(None, pair[1])], SMALL, noise=GaussianNormalNoise())
    data[0]
    assert len(pickle.dumps(data)) < 10_000
    loader = DataLoader(data, batch_size=2, num_workers=2)
    drawn = [batch.x for batch in loader]
    assert len(drawn) == 3
    assert not torch.equal(drawn[0], drawn[1])


def test_arrays_are_mapped(pair, tmp_path):
    data = PatchDataset(tmp_path, [pair], SMALL)
    data[0]
    assert all(isinstance(array.base, np.memmap) for array in data._entry(0).values())


def test_small_component(tmp_path):
    trimesh.creation.box().export(tmp_path / "box.ply")
    data = PatchDataset(tmp_path, [(None, tmp_path / "box.ply")], SMALL, noise=GaussianNormalNoise())[5]
    assert data.num_nodes == 12
    assert data.edge_index.size(1) == 120
    assert len(FreshPatchDataset(tmp_path, [(None, tmp_path / "box.ply")], noise=GaussianNormalNoise())[0].x) == 12


@BOTH
def test_rejects_input(pair, tmp_path, dataset):
    with pytest.raises(DataError, match=r"Expected at least one mesh \(got none\)"):
        dataset(tmp_path, [])
    with pytest.raises(DataError, match=r"Expected 'noise' for a clean mesh .* \(got None for '.*clean.ply'\)"):
        dataset(tmp_path, [(None, pair[1])])
    with pytest.raises(DataError, match=r"Expected a mesh file \(got '.*absent.ply', which does not exist\)"):
        dataset(tmp_path, [(Path("absent.ply"), pair[1])])
    with pytest.raises(ValueError, match=r"Expected 'noise_level' as 0 <= smallest <= largest \(got \(0.3, 0.1\)\)"):
        dataset(tmp_path, [pair], noise_level=(0.3, 0.1))
    with pytest.raises(ValueError, match=r"Expected 'num_patches' of at least 1 \(got 0\)"):
        dataset(tmp_path, [pair], PatchOptions(num_patches=0))
    trimesh.creation.box().export(tmp_path / "box.ply")
    with pytest.raises(DataError, match=r"Expected the same faces .* \(got 12 and 1280 faces\)"):
        dataset(tmp_path, [(tmp_path / "box.ply", pair[1])])
