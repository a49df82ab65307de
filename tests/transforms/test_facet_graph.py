import pytest
import torch
from torch_geometric.data import Batch, Data
from torch_geometric.transforms import Compose, Distance, NormalizeScale, RandomScale, ToUndirected

from dnf_pyg.errors import MeshError
from dnf_pyg.mesh import FacetGraph, nearest_faces
from dnf_pyg.transforms import JitterNormal, RandomRotation, ToFacetGraph


@pytest.fixture
def mesh(cube_mesh):
    pos, face = cube_mesh
    return Data(pos=pos.float(), face=face)


def test_matches_loop_over_faces(mesh):
    graph = ToFacetGraph(k=10)(mesh)
    graph.validate()
    assert (graph.num_nodes, graph.num_node_features, graph.num_edges) == (768, 3, 7680)
    nearest = nearest_faces(FacetGraph.from_mesh(mesh.pos, mesh.face), 10)
    for i in (0, 5, 767):
        corner = mesh.pos[mesh.face[:, i]]
        cross = torch.linalg.cross(corner[1] - corner[0], corner[2] - corner[0])
        torch.testing.assert_close(graph.x[i], cross / cross.norm())
        torch.testing.assert_close(graph.area[i], cross.norm() / 2)
        torch.testing.assert_close(graph.pos[i], corner.mean(dim=0))
        own = graph.edge_index[1] == i
        assert graph.edge_attr[own].tolist() == list(range(10))
        assert graph.edge_index[0, own].tolist() == nearest[i].tolist()


def test_small_components_have_fewer_edges(mesh):
    mesh.face = torch.cat([mesh.face[:, :1], mesh.face[:, 700:702]], dim=1)
    graph = ToFacetGraph(k=5)(mesh)
    assert graph.edge_index.tolist() == [[0, 1, 2, 2, 1], [0, 1, 1, 2, 2]]
    assert graph.edge_attr.tolist() == [0, 0, 1, 0, 1]


def test_targets_are_those_of_the_clean_mesh(mesh):
    clean = ToFacetGraph()(mesh).x
    assert "y" not in ToFacetGraph()(mesh)
    mesh.clean_pos, mesh.pos = mesh.pos, mesh.pos * torch.tensor([1.0, 2, 3])
    torch.testing.assert_close(ToFacetGraph()(mesh).y, clean)


def test_transforms_of_pyg_work_on_it(mesh):
    plain = ToFacetGraph(k=6)(mesh)
    torch.manual_seed(0)
    graph = Compose([ToFacetGraph(k=6), RandomScale((2, 2)), Distance(norm=False, cat=False)])(mesh)
    torch.testing.assert_close(graph.pos, 2 * plain.pos)
    source, target = plain.edge_index
    distance = 2 * (plain.pos[source] - plain.pos[target]).norm(dim=1)
    torch.testing.assert_close(graph.edge_attr.squeeze(1), distance)
    assert NormalizeScale()(ToFacetGraph(k=6)(mesh)).pos.abs().max() < 1
    both = ToUndirected(reduce="min")(ToFacetGraph(k=6)(mesh))  # the smaller of the two ranks
    assert both.is_undirected()
    assert both.edge_attr.max() == 5


def test_edges_may_be_stored_in_any_order(mesh):
    graph, sorted_graph = ToFacetGraph(k=6)(mesh), ToFacetGraph(k=6)(mesh).coalesce()
    assert not torch.equal(graph.edge_index, sorted_graph.edge_index)
    key = [{(*edge, rank) for *edge, rank in zip(*g.edge_index.tolist(), g.edge_attr.tolist(), strict=True)}
           for g in (graph, sorted_graph)]  # fmt: skip
    assert key[0] == key[1]


def test_batches_keep_meshes_apart(mesh):
    graphs = [ToFacetGraph(k=4)(mesh) for _ in range(2)]
    batch = Batch.from_data_list(graphs)
    assert torch.equal(batch.batch[batch.edge_index[0]], batch.batch[batch.edge_index[1]])


def test_input_stays(mesh):
    before = mesh.clone()
    ToFacetGraph(k=4)(mesh)
    assert mesh.keys() == before.keys()
    assert torch.equal(mesh.pos, before.pos)


def test_transforms_of_patches_work_on_it(mesh):
    graph = Compose([ToFacetGraph(k=4), RandomRotation(), JitterNormal()])(mesh)
    torch.testing.assert_close(graph.x.norm(dim=1), torch.ones(768))
    assert not torch.allclose(graph.pos, ToFacetGraph(k=4)(mesh).pos)


def test_repr_and_errors(mesh):
    assert str(ToFacetGraph(7)) == "ToFacetGraph(k=7)"
    with pytest.raises(ValueError, match=r"Expected 'k' of at least 1 \(got 0\). Raise it."):
        ToFacetGraph(0)
    mesh.pos[3] = float("nan")
    with pytest.raises(MeshError, match="finite"):
        ToFacetGraph()(mesh)
