import copy

import pytest
import torch
from torch_geometric.data import Batch
from torch_geometric.explain import Explainer, GNNExplainer

from dnf_pyg.nn import DNFNet
from dnf_pyg.nn.neighbors import edges_per_level


def small_net(**kwargs):
    arguments = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8} | kwargs
    return DNFNet(**arguments)


@pytest.mark.parametrize(("num_units", "count"), [(1, 286_419), (2, 361_686), (3, 436_953)])
def test_parameter_counts(num_units, count):
    assert sum(p.numel() for p in DNFNet(num_units=num_units).parameters()) == count


def test_stages_and_forward_agree(make):
    data, net = make.patch(20), small_net().eval()
    stages = net.stages(**net.gather(data))
    assert [tuple(r.shape) for _, r in stages] == [(20, 8)] * 2
    torch.testing.assert_close(net(data.x, data.edge_index, data.edge_attr), stages[-1][0])
    torch.testing.assert_close(stages[0][0].norm(dim=1), torch.ones(20))


def test_units_subtract_their_residuals(loops, make):
    data, net = make.patch(20), make.scramble(small_net()).eval()
    x, batch = net.embedding(data.x, data.edge_index, data.edge_attr), torch.zeros(20, dtype=torch.long)
    for unit, head, (filtered, residual) in zip(net.units, net.heads, net.stages(**net.gather(data)), strict=True):
        edges = loops.nearest_in_features(x, 3, batch)
        expected = loops.edge_mlp_max(unit.conv.mlp, x, x, edges, subtract=True)
        torch.testing.assert_close(residual, expected, rtol=0, atol=1e-10)
        x = x - expected
        out = super(type(head), head).forward(x)
        torch.testing.assert_close(filtered, out / out.norm(dim=1, keepdim=True), rtol=0, atol=1e-10)


@pytest.mark.parametrize("sizes", [[12, 12], [12, 2, 7, 1]])
def test_batch_equals_each_patch_alone(sizes, make):
    net, patches = make.scramble(small_net()).eval(), [make.patch(size) for size in sizes]
    with torch.no_grad():
        alone = torch.cat([net(**net.gather(data)) for data in patches])
        out = net(**net.gather(Batch.from_data_list(patches)))
    torch.testing.assert_close(out, alone, rtol=0, atol=1e-10)


def test_permuted_faces_permute_the_output(make):
    data, net, order = make.patch(15), make.scramble(small_net()).eval(), torch.randperm(15)
    expected = net(data.x, data.edge_index, data.edge_attr)[order]
    out = net(data.x[order], order.argsort()[data.edge_index], data.edge_attr)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("reorder", ["coalesce", "sort"])
def test_order_of_edges_does_not_matter(reorder, make):
    data, net = make.patch(15), make.scramble(small_net()).eval()
    out = net(**net.gather(getattr(data.clone(), reorder)()))
    torch.testing.assert_close(out, net(**net.gather(data)), rtol=0, atol=1e-10)


def test_edges_per_level_and_fewer_neighbours(make):
    data, net = make.patch(15), make.scramble(small_net()).eval()
    levels = edges_per_level(data.edge_index, data.edge_attr, net.k)
    expected = net(**net.gather(data))
    torch.testing.assert_close(net(**net.gather(data, levels)), expected, rtol=0, atol=0)
    few = make.patch(15, k=3)  # fewer than the upper levels use
    assert torch.isfinite(net(**net.gather(few))).all()


@pytest.mark.parametrize("sizes", [[12], [12, 9], [1]])
def test_training_step(sizes, make):
    net, batch = small_net().train(), Batch.from_data_list([make.patch(size) for size in sizes])
    stages = net.stages(**net.gather(batch))
    sum((f - batch.x).square().sum() + r.square().sum() for f, r in stages).backward()
    assert all(p.grad is not None and torch.isfinite(p.grad).all() for p in net.parameters())
    if sizes != [1]:
        weights = [p.grad for name, p in net.named_parameters() if name.endswith("lins.0.weight")]
        assert all(g.abs().sum() > 0 for g in weights)


def test_gradcheck(make):
    net = make.scramble(small_net(k=(2, 3), channels=(4, 4), embedding_channels=4, num_units=1)).train()
    data, batch = make.patch(8, k=3), torch.zeros(8, dtype=torch.long)
    names = [name for name, _ in net.named_parameters()]

    def run(*values):
        state = {name: b.clone() for name, b in net.named_buffers()} | dict(zip(names, values, strict=True))
        return torch.func.functional_call(net, state, (data.x, data.edge_index, data.edge_attr, batch))

    assert torch.autograd.gradcheck(
        run, tuple(p.detach().clone().requires_grad_() for p in net.parameters()), fast_mode=True
    )


def test_compile(make):
    net = make.scramble(small_net(k=(2, 4), channels=(8, 8), num_units=1)).eval()
    compiled = torch.compile(net, dynamic=True, fullgraph=True)
    with torch.no_grad():
        for num_faces in (15, 21):
            data = make.patch(num_faces)
            levels = edges_per_level(data.edge_index, data.edge_attr, net.k)
            torch.testing.assert_close(compiled(data.x, levels), net(data.x, levels), rtol=0, atol=1e-10)


def test_explain_features(make):
    explainer = Explainer(
        small_net(),
        GNNExplainer(epochs=3),
        explanation_type="model",
        node_mask_type="attributes",
        model_config={"mode": "regression", "task_level": "node"},
    )
    data = make.patch(12)
    assert explainer(data.x, data.edge_index, edge_attr=data.edge_attr).node_mask.abs().sum() > 0


def test_single_precision_agrees(make):
    net, data = make.scramble(DNFNet()).eval(), make.patch(200, k=50)
    with torch.no_grad():
        features = net.embedding(data.x, data.edge_index, data.edge_attr)
        single = copy.deepcopy(net).float().embedding(data.x.float(), data.edge_index, data.edge_attr)
    torch.testing.assert_close(single.double(), features, rtol=0, atol=1e-5 * float(features.abs().max()))


def test_reset_and_errors(make):
    net = make.scramble(small_net())
    net.reset_parameters()
    assert net.heads[0].norms[0].module.weight.tolist() == [1.0] * 8
    with pytest.raises(ValueError, match=r"'num_units' to be positive \(got 0\)"):
        DNFNet(num_units=0)
