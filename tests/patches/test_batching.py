import pytest
import torch
import trimesh
from torch_geometric.data import Batch

from dnf_pyg.nn import SurfaceDNFNet
from dnf_pyg.patches import FaceFeatures, PatchExtractor, cover, patch_to_data
from dnf_pyg.patches.batching import batches
from dnf_pyg.patches.fusion import PatchFusion


def parts(*meshes):
    """Meshes side by side, each a component of its own."""
    joined = trimesh.util.concatenate([part.apply_translation([4.0 * at, 0, 0]) for at, part in enumerate(meshes)])
    return torch.tensor(joined.vertices), torch.tensor(joined.faces).t().contiguous()


@pytest.fixture(scope="module")
def small_parts():
    """Components of 320, 1, 12, 20, 1, 2, 12 and 80 faces."""
    ball, box = trimesh.creation.icosphere, trimesh.creation.box
    lone = trimesh.Trimesh(torch.eye(3).numpy(), [[0, 1, 2]])
    pair = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.2]], [[0, 1, 2], [1, 3, 2]])
    pos, face = parts(ball(subdivisions=2), lone, box(), ball(subdivisions=0), lone.copy(), pair, box(), ball(1))
    return pos + 0.05 * torch.randn(pos.shape, dtype=pos.dtype, generator=torch.Generator().manual_seed(0)), face


def patches_of(mesh, patch_size=50, k=8):
    extractor = PatchExtractor(*mesh, patch_size=patch_size, k=k)
    return list(cover(extractor, 2, torch.Generator().manual_seed(0))), FaceFeatures.from_mesh(*mesh)


@pytest.mark.parametrize("max_faces", [1, 50, 130, 10_000])
def test_batches_hold_all_patches_in_order_and_no_more_faces_than_allowed(small_parts, max_faces):
    patches, features = patches_of(small_parts)
    groups = [group for group, _ in batches(iter(patches), features, max_faces)]
    assert [id(patch) for group in groups for patch in group] == [id(patch) for patch in patches]
    sizes = [sum(len(patch.face_id) for patch in group) for group in groups]
    assert all(size <= max_faces or len(group) == 1 for size, group in zip(sizes, groups, strict=True))
    for size, after in zip(sizes, groups[1:], strict=False):
        assert size + len(after[0].face_id) > max_faces  # none could be larger


def test_full_patches_make_batches_of_equal_number(sphere_mesh):
    patches, features = patches_of(sphere_mesh, patch_size=60)
    groups = [len(group) for group, _ in batches(patches, features, 4 * 60)]
    assert set(groups[:-1]) == {4}
    assert sum(groups) == len(patches)


def test_batch_equals_that_of_single_patches(small_parts):
    patches, features = patches_of(small_parts)
    for group, data in batches(patches, features, 130):
        expected = Batch.from_data_list([patch_to_data(patch, features) for patch in group])
        assert set(data.keys()) == set(expected.keys()) - {"ptr"}
        for name in data.keys():  # noqa: SIM118 - iterating over Data gives pairs
            assert torch.equal(data[name], expected[name]), name
            assert data[name].dtype == expected[name].dtype


def test_result_does_not_depend_on_the_batches(small_parts):
    torch.manual_seed(0)
    net = SurfaceDNFNet(k=(4, 6, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4).double().eval()
    patches, features = patches_of(small_parts)
    results = []
    for max_faces in (1, 130, 10_000):
        fusion = PatchFusion(small_parts[1].size(1))
        for group, data in batches(patches, features, max_faces):
            with torch.no_grad():
                fusion.add(group, net(**net.gather(data)).float())
        results.append(fusion.result())
    for other in results[1:]:
        assert torch.equal(other.coverage, results[0].coverage)
        torch.testing.assert_close(other.normal, results[0].normal)


def test_no_patches(sphere_mesh):
    assert list(batches([], FaceFeatures.from_mesh(*sphere_mesh), 10)) == []
