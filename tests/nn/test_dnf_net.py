import copy

import pytest
import torch
from torch_geometric.data import Batch, Data
from torch_geometric.explain import Explainer, GNNExplainer

from dnf_pyg.nn import DNFNet
from dnf_pyg.nn.neighbors import sort_by_center


def random_patch(num_faces, k=6):
    """Unit normals and, for each face, itself and k - 1 other faces."""
    normal = torch.nn.functional.normalize(torch.randn(num_faces, 3), dim=-1)
    order = torch.rand(num_faces, num_faces).fill_diagonal_(-1).argsort(dim=1)[:, :k]
    return normal, torch.stack([order.flatten(), torch.arange(num_faces).repeat_interleave(order.size(1))])


def batch_of(sizes):
    patches = [random_patch(n) for n in sizes]
    return Batch.from_data_list([Data(normal=n, edge_index=e, num_nodes=len(n)) for n, e in patches])


def small_net(**kwargs):
    arguments = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8} | kwargs
    return DNFNet(**arguments)


@pytest.mark.parametrize(("num_units", "count"), [(1, 286_419), (2, 361_686), (3, 436_953)])
def test_parameter_counts(num_units, count):
    assert sum(p.numel() for p in DNFNet(num_units=num_units).parameters()) == count


@pytest.mark.parametrize("align", [False, True])
def test_stages_and_forward_agree(align):
    normal, edge_index = random_patch(20)
    net = small_net(align=align).eval()
    stages = net.stages(normal, edge_index)
    assert [tuple(r.shape) for _, r in stages] == [(20, 8)] * 2
    torch.testing.assert_close(net(normal, edge_index), stages[-1][0])
    torch.testing.assert_close(stages[0][0].norm(dim=1), torch.ones(20))


def test_units_subtract_their_residuals(loops, make):
    normal, edge_index = random_patch(20)
    net = make.scramble(small_net()).eval()
    x, batch = net.embedding(normal, edge_index), torch.zeros(20, dtype=torch.long)
    for unit, head, (filtered, residual) in zip(net.units, net.heads, net.stages(normal, edge_index), strict=True):
        edges = loops.nearest_in_features(x, 3, batch)
        expected = loops.edge_mlp_max(unit.conv.mlp, x, x, edges, subtract=True)
        torch.testing.assert_close(residual, expected, rtol=0, atol=1e-10)
        x = x - expected
        out = head(x)
        torch.testing.assert_close(filtered, out / out.norm(dim=1, keepdim=True), rtol=0, atol=1e-10)


def random_surface(num_faces):
    """Centroids and areas."""
    return torch.cat([torch.randn(num_faces, 3), torch.rand(num_faces, 1) + 0.1], dim=1)


def test_network_that_sees_the_surface_moves_with_the_mesh(make):
    normal, edge_index = random_patch(15)
    surface = random_surface(15)
    net = make.scramble(small_net(align=True, surface=True, bilateral_iterations=2)).eval()
    turn = torch.linalg.qr(torch.randn(3, 3)).Q
    place, area = 7 * surface[:, :3] @ turn.t() + 5, 49 * surface[:, 3:]
    out = net(normal @ turn.t(), edge_index, surface=torch.cat([place, area], dim=1))
    torch.testing.assert_close(out, net(normal, edge_index, surface=surface) @ turn.t(), rtol=0, atol=1e-8)
    assert not torch.allclose(
        net(normal, edge_index, surface=random_surface(15)), net(normal, edge_index, surface=surface)
    )


def test_batch_of_surfaces_equals_each_alone(make):
    net = make.scramble(small_net(align=True, surface=True, bilateral_iterations=2)).eval()
    batch, surface = batch_of([12, 2, 7]), random_surface(21)
    alone = [
        net(data.normal, data.edge_index, surface=own)
        for data, own in zip(batch.to_data_list(), surface.split([12, 2, 7]), strict=True)
    ]
    out = net(batch.normal, batch.edge_index, batch.batch, surface)
    torch.testing.assert_close(out, torch.cat(alone), rtol=0, atol=1e-10)


def test_network_that_sees_the_surface_asks_for_it():
    normal, edge_index = random_patch(5)
    with pytest.raises(ValueError, match=r"'surface' of shape \[num_faces, 4\] .* \(got None\): pass `data.surface`"):
        small_net(surface=True)(normal, edge_index)


@pytest.mark.parametrize("align", [False, True])
@pytest.mark.parametrize("sizes", [[12, 12], [12, 2, 7, 1]])
def test_batch_equals_each_patch_alone(align, sizes, make):
    net = make.scramble(small_net(align=align)).eval()
    batch = batch_of(sizes)
    with torch.no_grad():
        alone = [net(d.normal, d.edge_index) for d in batch.to_data_list()]
        out = net(batch.normal, batch.edge_index, batch.batch)
    torch.testing.assert_close(out, torch.cat(alone), rtol=0, atol=1e-10)


def test_permuted_faces_permute_the_output(make):
    normal, edge_index = random_patch(15)
    net, order = make.scramble(small_net()).eval(), torch.randperm(15)
    expected = net(normal, edge_index)[order]
    torch.testing.assert_close(net(normal[order], order.argsort()[edge_index]), expected, rtol=0, atol=1e-10)


def test_aligned_network_turns_with_the_patch(make):
    normal, edge_index = random_patch(15)
    net, turn = make.scramble(small_net(align=True)).eval(), torch.linalg.qr(torch.randn(3, 3)).Q
    expected = net(normal, edge_index) @ turn.t()
    torch.testing.assert_close(net(normal @ turn.t(), edge_index), expected, rtol=0, atol=1e-8)


def test_edges_per_level_and_short_rows(make):
    normal, edge_index = random_patch(15)
    net = make.scramble(small_net()).eval()
    expected = net(normal, edge_index)
    cut = [sort_by_center(edge_index, (15, 15), k).as_tensor() for k in (2, 4, 6)]
    torch.testing.assert_close(net(normal, cut), expected, rtol=0, atol=0)
    short = sort_by_center(edge_index, (15, 15), 3).as_tensor()  # fewer than the upper levels want
    assert torch.isfinite(net(normal, short)).all()


@pytest.mark.parametrize("sizes", [[12], [12, 9], [1]])
def test_training_step(sizes):
    net, batch = small_net().train(), batch_of(sizes)
    stages = net.stages(batch.normal, batch.edge_index, batch.batch)
    sum((f - batch.normal).square().sum() + r.square().sum() for f, r in stages).backward()
    assert all(p.grad is not None and torch.isfinite(p.grad).all() for p in net.parameters())
    if sizes != [1]:
        weights = [p.grad for name, p in net.named_parameters() if name.endswith("lins.0.weight")]
        assert all(g.abs().sum() > 0 for g in weights)


def test_gradcheck(make):
    net = make.scramble(small_net(k=(2, 3), channels=(4, 4), embedding_channels=4, num_units=1)).train()
    normal, edge_index = random_patch(8, k=3)
    names = [name for name, _ in net.named_parameters()]
    batch = torch.tensor([0] * 8)

    def run(*values):
        state = {name: b.clone() for name, b in net.named_buffers()} | dict(zip(names, values, strict=True))
        return torch.func.functional_call(net, state, (normal, edge_index, batch))

    assert torch.autograd.gradcheck(
        run, tuple(p.detach().clone().requires_grad_() for p in net.parameters()), fast_mode=True
    )


def test_compile(make):
    net = make.scramble(small_net(k=(2, 4), channels=(8, 8), num_units=1)).eval()
    compiled = torch.compile(net, dynamic=True, fullgraph=True)
    with torch.no_grad():
        for num_faces in (15, 21):
            normal, edge_index = random_patch(num_faces)
            torch.testing.assert_close(compiled(normal, edge_index), net(normal, edge_index), rtol=0, atol=1e-10)


def test_explain_features():
    normal, edge_index = random_patch(12)
    explainer = Explainer(
        small_net(),
        GNNExplainer(epochs=3),
        explanation_type="model",
        node_mask_type="attributes",
        model_config={"mode": "regression", "task_level": "node"},
    )
    assert explainer(normal, edge_index).node_mask.abs().sum() > 0


def test_single_precision_agrees(make):
    net = make.scramble(DNFNet()).eval()
    normal, edge_index = random_patch(200, k=50)
    with torch.no_grad():
        features = net.embedding(normal, edge_index)
        single = copy.deepcopy(net).float().embedding(normal.float(), edge_index)
    torch.testing.assert_close(single.double(), features, rtol=0, atol=1e-5 * float(features.abs().max()))


def test_config_and_pretrained_round_trip(tmp_path, make):
    net = make.scramble(small_net(align=True)).float().eval()
    net.save_pretrained(tmp_path)
    loaded = DNFNet.from_pretrained(tmp_path).float().eval()
    assert DNFNet(**net.config).config == loaded.config == net.config
    normal, edge_index = random_patch(20)
    torch.testing.assert_close(loaded(normal.float(), edge_index), net(normal.float(), edge_index), rtol=0, atol=0)
    again = small_net(align=True).float()
    again.load_state_dict(net.state_dict())
    torch.testing.assert_close(dict(again.named_parameters()), dict(net.named_parameters()), rtol=0, atol=0)


def test_reset_and_errors(make):
    net = make.scramble(small_net())
    net.reset_parameters()
    assert net.heads[0].norms[0].module.weight.tolist() == [1.0] * 8
    with pytest.raises(ValueError, match=r"'num_units' to be positive \(got 0\)"):
        DNFNet(num_units=0)


def test_autocast_keeps_directions_precise(make):
    normal, edge_index = random_patch(30)
    net = small_net(align=True).float().eval()
    with torch.autocast("cpu", torch.bfloat16):
        for filtered, _ in net.stages(normal.float(), edge_index):
            assert filtered.dtype == torch.float32
            torch.testing.assert_close(filtered.norm(dim=1), torch.ones(30).float())
