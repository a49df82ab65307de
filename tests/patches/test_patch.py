import numpy as np
import pytest
import torch
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from torch_geometric.data import Batch

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh import HeatGrowth, face_normals, nearest_faces
from dnf_pyg.nn import nearest_edges
from dnf_pyg.patches import FaceFeatures, PatchExtractor, patch_to_data


def brute_force(graph, face_id, k):
    """K nearest rows of the patch by (distance inside the patch, face id), padded with -1."""
    rank = np.argsort(face_id)  # equal distances fall by face id
    size = (graph.num_faces, graph.num_faces)
    whole = csr_array((graph.length.astype(np.float64), graph.neighbor, graph.ptr), shape=size)
    distance = dijkstra(whole[face_id[rank]][:, face_id[rank]])
    order = np.argsort(distance, axis=1, kind="stable")[:, :k]
    rows = np.where(np.isfinite(np.take_along_axis(distance, order, axis=1)), rank[order], -1)
    out = np.empty_like(rows)
    out[rank] = rows
    return out


@pytest.mark.parametrize("k", [1, 10, 50])
def test_neighbors_match_brute_force(cube_mesh, k):
    extractor = PatchExtractor(*cube_mesh, patch_size=200, k=k)
    for seed in (0, 333, 767):
        patch = extractor.extract(seed)
        assert patch.neighbor.dtype == torch.int16
        assert patch.face_id[0] == seed
        assert np.array_equal(patch.neighbor, brute_force(extractor.graph, patch.face_id.numpy(), k))


def test_inside_a_patch_neighbors_are_those_of_the_whole_mesh(cube_mesh):
    extractor = PatchExtractor(*cube_mesh, patch_size=300, k=20)
    patch = extractor.extract(400)
    nearest = nearest_faces(extractor.graph, k=20)[patch.face_id].long()
    inside = torch.isin(nearest, patch.face_id).all(dim=1)
    assert inside.sum() > 100
    assert torch.equal(patch.face_id[patch.neighbor[inside].long()], nearest[inside])


def test_a_second_patch_is_not_touched_by_the_first(cube_mesh):
    used, new = (PatchExtractor(*cube_mesh, patch_size=100, k=10) for _ in range(2))
    for seed in (1, 500):
        used.extract(seed)
    for one, other in zip(used.extract(1), new.extract(1), strict=True):
        assert torch.equal(one, other)


def test_data_form(cube_mesh):
    pos, face = cube_mesh
    normal = face_normals(pos, face)
    patch = PatchExtractor(pos, face, patch_size=100, k=10).extract(7)
    data = patch_to_data(patch, FaceFeatures.from_mesh(pos, face), clean_normal=-normal)
    data.validate()
    assert data.num_nodes == 100
    assert data.edge_index.shape == (2, 1000)
    assert data.edge_index.dtype == torch.long
    assert torch.equal(data.edge_index[1], torch.arange(100).repeat_interleave(10))
    assert torch.equal(data.edge_index.view(2, 100, 10)[0, :, 0], torch.arange(100))  # itself first
    assert torch.equal(data.edge_attr, torch.arange(10).repeat(100))
    assert data.num_node_features == 3
    assert torch.equal(data.x, normal[patch.face_id].float())
    assert torch.equal(data.y, -data.x)
    assert "y" not in patch_to_data(patch, FaceFeatures.from_mesh(pos, face))


def test_ranks_stay_with_their_edges(cube_mesh):
    """What PyG does to the order of edges changes no level of nearest faces."""
    data = patch_to_data(PatchExtractor(*cube_mesh, patch_size=60, k=9).extract(3), FaceFeatures.from_mesh(*cube_mesh))
    expected = {tuple(edge) for edge in nearest_edges(data.edge_index, data.edge_attr, 4).t().tolist()}
    assert len(expected) == 240
    for other in (data.coalesce(), data.sort(sort_by_row=False), data.sort()):
        assert {tuple(edge) for edge in nearest_edges(other.edge_index, other.edge_attr, 4).t().tolist()} == expected


def test_places_are_relative_to_the_seed(cube_mesh):
    pos, face = cube_mesh
    patch = PatchExtractor(pos, face, patch_size=100, k=10).extract(7)
    far = pos.double() + 1e6
    data = patch_to_data(patch, FaceFeatures.from_mesh(far, face))
    corner = far[face[:, patch.face_id]]
    for i in (0, 1, 57, 99):
        place = corner[:, i].sum(dim=0) / 3 - corner[:, 0].sum(dim=0) / 3
        area = torch.linalg.cross(corner[1, i] - corner[0, i], corner[2, i] - corner[0, i]).norm() / 2
        torch.testing.assert_close(data.pos[i], place.float(), atol=1e-6, rtol=1e-5)
        torch.testing.assert_close(data.area[i], area.float(), atol=1e-6, rtol=1e-5)


def test_batch_keeps_patches_apart(cube_mesh):
    pos, face = cube_mesh
    extractor = PatchExtractor(pos, face, patch_size=60, k=5)
    patches = [patch_to_data(extractor.extract(seed), FaceFeatures.from_mesh(pos, face)) for seed in (0, 600)]
    batch = Batch.from_data_list(patches)
    assert batch.seed_index.tolist() == [0, 60]
    assert torch.equal(batch.edge_index[:, 300:] - 60, patches[1].edge_index)
    assert torch.equal(batch.edge_attr[300:], patches[1].edge_attr)
    assert torch.equal(batch.batch[batch.edge_index[0]], batch.batch[batch.edge_index[1]])
    assert torch.equal(batch.edge_index[1], batch.edge_index[1].sort().values)
    assert torch.equal(batch[1].face_id, patches[1].face_id)


def test_component_smaller_than_patch_and_k(sphere_mesh):
    pos, face = sphere_mesh
    strip = torch.cat([face[:, :2], face[:, 100:103]], dim=1)
    patch = PatchExtractor(pos, strip, patch_size=4, k=50).extract(0)
    assert patch.neighbor.shape[0] == len(patch.face_id) <= 4
    data = patch_to_data(patch, FaceFeatures.from_mesh(pos, strip))
    data.validate()
    assert (data.edge_index >= 0).all()


def test_ragged_rows_keep_their_order():
    pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [-1, 0, 0]])
    face = torch.tensor([[0, 0], [1, 3], [2, 4]])
    heat_like = PatchExtractor(pos, face, k=2).extract(0)
    cut = heat_like._replace(neighbor=torch.tensor([[0, -1], [1, 0]], dtype=torch.int16))
    data = patch_to_data(cut, FaceFeatures.from_mesh(pos, face))
    assert data.edge_index.tolist() == [[0, 1, 0], [0, 1, 1]]
    assert data.edge_attr.tolist() == [0, 0, 1]


def test_one_triangle():
    pos, face = torch.eye(3), torch.tensor([[0], [1], [2]])
    for growth in (None, HeatGrowth()):
        data = patch_to_data(PatchExtractor(pos, face, growth).extract(0), FaceFeatures.from_mesh(pos, face))
        assert data.edge_index.tolist() == [[0], [0]]


def test_heat_growth(sphere_mesh):
    patch = PatchExtractor(*sphere_mesh, HeatGrowth(), patch_size=100, k=10).extract(5)
    assert len(patch.face_id) == 100
    assert (patch.neighbor >= 0).all()


def test_rejects_arguments(cube_mesh):
    with pytest.raises(ValueError, match=r"Expected 'patch_size' from 1 to 32767 \(got 32768\)"):
        PatchExtractor(*cube_mesh, patch_size=32768)
    with pytest.raises(ValueError, match=r"Expected 'k' of at least 1 \(got 0\)"):
        PatchExtractor(*cube_mesh, k=0)
    with pytest.raises(ValueError, match=r"Expected 'seed' from 0 to 767 \(got 768\)"):
        PatchExtractor(*cube_mesh).extract(768)
    with pytest.raises(MeshError, match="finite"):
        PatchExtractor(cube_mesh[0] * float("nan"), cube_mesh[1])
