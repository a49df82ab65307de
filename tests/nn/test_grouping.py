import copy

import pytest
import torch
from torch_geometric import EdgeIndex
from torch_geometric.data import Batch, Data
from torch_geometric.explain import Explainer, GNNExplainer
from torch_geometric.nn import EdgeConv
from torch_geometric.testing import assert_module

from dnf_pyg.nn import FeatureGroupingConv, NormalGroupingConv, SurfaceGroupingConv
from dnf_pyg.nn.grouping import GroupingConv

CONVS = [NormalGroupingConv, FeatureGroupingConv]
GRAPHS = {"equal": [4] * 9, "ragged": [3, 0, 1, 5, 3, 2, 0, 1, 4], "one edge": [0, 1]}


def states(conv):
    return [*conv.parameters(), *(b.to(torch.float64) for b in conv.buffers())]


@pytest.fixture(params=[False, True], ids=["one block", "many blocks"])
def blocks(request, monkeypatch):
    if request.param:
        monkeypatch.setattr("dnf_pyg.nn.kernels.rows.BLOCK_NUMBERS", {"cpu": 100})


@pytest.mark.parametrize("cls", CONVS)
@pytest.mark.parametrize("hidden", [[], [8], [8, 6], [4, 8, 6]])
@pytest.mark.parametrize("degrees", [GRAPHS["equal"], GRAPHS["ragged"]], ids=["equal", "ragged"])
@pytest.mark.parametrize("training", [False, True])
@pytest.mark.usefixtures("blocks")
def test_matches_loops(cls, hidden, degrees, training, loops, make):
    conv = make.scramble(cls(5, 7, hidden_channels=hidden)).train(training)
    reference = copy.deepcopy(conv)
    x = torch.randn(len(degrees), 5, requires_grad=True)
    edge_index = make.random_edges(degrees, len(degrees))
    expected = loops.edge_mlp_max(reference.mlp, x, x, edge_index, subtract=cls is FeatureGroupingConv)
    out = conv(x, edge_index)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    grads = make.gradients(out, [x, *conv.parameters()])
    expected_grads = make.gradients(expected, [x, *reference.parameters()])
    torch.testing.assert_close(grads, expected_grads, rtol=0, atol=1e-10)
    with torch.no_grad():
        torch.testing.assert_close(conv(x, edge_index), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("training", [False, True])
@pytest.mark.usefixtures("blocks")
def test_places_count_by_their_difference(training, loops, make):
    conv = make.scramble(SurfaceGroupingConv(2 + 3, 7)).train(training)
    plain = NormalGroupingConv(2 + 3, 7).train(training)
    state = conv.state_dict()
    own, difference, offset = state["mlp.lins.0.weight"].split([2, 2, 3], dim=1)
    weight = torch.cat([own - difference, -offset, difference, offset], dim=1)
    plain.load_state_dict(state | {"mlp.lins.0.weight": weight})
    x, edge_index = torch.randn(9, 5, requires_grad=True), make.random_edges(GRAPHS["ragged"], 9)
    expected = loops.edge_mlp_max(plain.mlp, x, x, edge_index, subtract=False)
    out = conv(x, edge_index)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    torch.testing.assert_close(make.gradients(out, [x]), make.gradients(expected, [x]), rtol=0, atol=1e-10)
    moved = x + torch.tensor([0.0, 0, 3, -2, 5])
    torch.testing.assert_close(conv(moved, edge_index), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("degrees", GRAPHS.values(), ids=GRAPHS)
@pytest.mark.usefixtures("blocks")
def test_running_statistics_are_those_of_batch_norm(degrees, make, monkeypatch):
    fused = make.scramble(FeatureGroupingConv(5, 7, hidden_channels=[8, 6]))
    plain = copy.deepcopy(fused)
    x, edge_index = torch.randn(len(degrees), 5), make.random_edges(degrees, len(degrees))
    out = fused(x, edge_index)
    monkeypatch.setattr(GroupingConv, "_can_fuse", lambda self, edge_index: False)
    torch.testing.assert_close(out, plain(x, edge_index))
    torch.testing.assert_close(states(fused), states(plain), rtol=0, atol=1e-12)


@pytest.mark.parametrize("cls", CONVS)
@pytest.mark.parametrize("training", [False, True])
def test_every_layout_of_edges(cls, training, make):
    conv = make.scramble(cls(5, 7)).train(training)
    x = torch.randn(9, 5)
    edge_index = make.random_edges(GRAPHS["ragged"], 9).unique(dim=1)
    with torch.no_grad():
        assert_module(conv, x, edge_index, expected_size=(9, 7), atol=1e-12)
        sorted_by_row = EdgeIndex(edge_index.contiguous(), sparse_size=(9, 9)).sort_by("row")[0]
        torch.testing.assert_close(conv(x, sorted_by_row), conv(x, edge_index))


@pytest.mark.parametrize("training", [False, True])
def test_permuted_faces_permute_the_output(training, make):
    conv = make.scramble(FeatureGroupingConv(5, 7)).train(training)
    x, edge_index, order = torch.randn(9, 5), make.random_edges(GRAPHS["ragged"], 9), torch.randperm(9)
    with torch.no_grad():
        out = conv(x[order], order.argsort()[edge_index])
        torch.testing.assert_close(out, conv(x, edge_index)[order], rtol=0, atol=1e-12)


@pytest.mark.parametrize("cls", CONVS)
@pytest.mark.parametrize("training", [False, True])
def test_bipartite(cls, training, loops, make):
    conv = make.scramble(cls(5, 7)).train(training)
    x_src, x_dst = torch.randn(6, 5), torch.randn(3, 5)
    edge_index = make.random_edges([2, 0, 3], 6)
    expected = loops.edge_mlp_max(conv.mlp, x_src, x_dst, edge_index, subtract=cls is FeatureGroupingConv)
    torch.testing.assert_close(conv((x_src, x_dst), edge_index), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("training", [False, True])
def test_no_edges_gives_zeros(training):
    conv = NormalGroupingConv(3, 4).train(training)
    assert conv(torch.randn(2, 3), torch.zeros(2, 0, dtype=torch.long)).tolist() == [[0.0] * 4] * 2


@pytest.mark.parametrize("cls", CONVS)
@pytest.mark.parametrize("training", [False, True])
def test_equals_the_composition_of_pyg(cls, training, make):
    """``EdgeConv(MLP)`` for differences of features; the same with other messages for the features themselves."""

    class Plain(EdgeConv):
        def message(self, x_i, x_j):
            return self.nn(torch.cat([x_i, x_j], dim=-1))

    conv = make.scramble(cls(5, 7)).train(training)
    plain = (EdgeConv if cls is FeatureGroupingConv else Plain)(copy.deepcopy(conv.mlp), aggr="max")
    plain.nn.load_state_dict(conv.mlp.state_dict())  # EdgeConv draws new weights
    x, edge_index = torch.randn(9, 5), make.random_edges(GRAPHS["ragged"], 9)
    with torch.no_grad():
        torch.testing.assert_close(conv(x, edge_index), plain(x, edge_index), rtol=0, atol=1e-10)


@pytest.mark.parametrize("cls", [*CONVS, SurfaceGroupingConv])
@pytest.mark.parametrize("training", [False, True])
def test_order_of_edges_does_not_matter(cls, training, make):
    conv = make.scramble(cls(5, 7)).train(training)
    x, edge_index = torch.randn(9, 5), make.random_edges(GRAPHS["ragged"], 9).unique(dim=1)
    shuffled = edge_index[:, torch.randperm(edge_index.size(1))]
    coalesced = Data(x=x, edge_index=shuffled).coalesce().edge_index
    with torch.no_grad():
        expected = conv(x, edge_index)
        for edges in (shuffled, coalesced, Data(x=x, edge_index=shuffled).sort().edge_index):
            torch.testing.assert_close(conv(x, edges), expected, rtol=0, atol=1e-12)


def test_batch_equals_each_graph_alone(make):
    conv = make.scramble(FeatureGroupingConv(5, 7)).eval()
    graphs = [
        Data(x=torch.randn(len(d), 5), edge_index=make.random_edges(d, len(d))) for d in ([3, 3, 3, 3], [2, 0, 1])
    ]
    batch = Batch.from_data_list(graphs)
    for grad in (True, False):
        with torch.set_grad_enabled(grad):
            alone = torch.cat([conv(g.x, g.edge_index) for g in graphs])
            torch.testing.assert_close(conv(batch.x, batch.edge_index), alone, rtol=0, atol=1e-12)


@pytest.mark.parametrize("training", [False, True])
def test_gradcheck(training, make):
    conv = make.scramble(FeatureGroupingConv(3, 4)).train(training)
    edge_index = make.random_edges([3, 2, 0, 3], 4)
    names = [name for name, _ in conv.named_parameters()]

    def run(x, *values):
        state = {name: b.clone() for name, b in conv.named_buffers()} | dict(zip(names, values, strict=True))
        return torch.func.functional_call(conv, state, (x, edge_index))

    inputs = [torch.randn(4, 3, requires_grad=True), *(p.detach().clone().requires_grad_() for p in conv.parameters())]
    assert torch.autograd.gradcheck(run, inputs)


def test_frozen_norms_train_the_rest(loops, make):
    """Fine-tuning with batch normalization in evaluation, all of it or a part, is exact as well."""
    x, edge_index = torch.randn(9, 5), make.random_edges(GRAPHS["ragged"], 9)
    for frozen in (slice(0, 3), slice(1, 2)):
        conv = make.scramble(FeatureGroupingConv(5, 7)).train()
        for norm in conv.mlp.norms[frozen]:
            norm.eval()
        expected = loops.edge_mlp_max(conv.mlp, x, x, edge_index, subtract=True)
        torch.testing.assert_close(conv(x, edge_index), expected, rtol=0, atol=1e-10)


def test_ties_pass_the_gradient_once():
    conv = FeatureGroupingConv(2, 4)
    x = torch.ones(3, 2, requires_grad=True)  # all messages are equal
    grads = torch.autograd.grad(conv(x, torch.tensor([[0, 1, 2], [0, 0, 0]])).sum(), conv.parameters())
    assert all(torch.isfinite(g).all() for g in grads)


@pytest.mark.parametrize("training", [False, True])
def test_single_precision_agrees(training, make):
    conv = make.scramble(FeatureGroupingConv(16, 32)).train(training)
    x, edge_index = torch.randn(60, 16), make.random_edges([10] * 30 + [7] * 30, 60)
    with torch.no_grad():
        expected = conv(x, edge_index)
        out = conv.float()(x.float(), edge_index)
    torch.testing.assert_close(out.double(), expected, rtol=1e-4, atol=1e-5 * float(expected.abs().max()))


@pytest.mark.parametrize("training", [False, True])
def test_autocast(training, make):
    conv = make.scramble(FeatureGroupingConv(16, 32)).float().train(training)
    x, edge_index = torch.randn(60, 16).float(), make.random_edges([10] * 60, 60)
    with torch.no_grad():
        expected = conv(x, edge_index)
    with torch.autocast("cpu", torch.bfloat16), torch.set_grad_enabled(training):
        out = conv(x, edge_index)
    assert out.dtype == torch.bfloat16
    assert float((out.detach() - expected).abs().mean()) < 0.03 * float(expected.abs().mean())
    if training:
        out.sum().backward()
        assert all(p.grad.dtype == torch.float32 and torch.isfinite(p.grad).all() for p in conv.parameters())


def test_keeps_no_array_of_all_edges():
    """What is saved for the backward pass is the products of the one inner layer, not every step on every edge."""
    conv = FeatureGroupingConv(8, 64).float()
    x, edge_index = torch.randn(100, 8).float(), torch.arange(100).repeat(2, 20)
    saved = []
    with torch.autograd.graph.saved_tensors_hooks(lambda t: saved.append(t) or t, lambda t: t):
        conv(x, edge_index)
    large = [t for t in saved if t.dim() == 2 and t.size(0) >= 2000 and t.is_floating_point()]
    assert [tuple(t.shape) for t in large] == [(2000, 32)]


@pytest.mark.parametrize("cls", CONVS)
def test_explain(cls):
    class Model(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.conv, self.lin = cls(5, 8), torch.nn.Linear(8, 2)

        def forward(self, x, edge_index):
            return self.lin(self.conv(x, edge_index))

    explainer = Explainer(
        Model(),
        GNNExplainer(epochs=3),
        explanation_type="model",
        node_mask_type="attributes",
        edge_mask_type="object",
        model_config={"mode": "regression", "task_level": "node"},
    )
    edge_index = torch.tensor([[3, 1, 0, 2, 2], [1, 0, 1, 1, 3]])
    explanation = explainer(torch.randn(4, 5), edge_index)
    assert explanation.edge_mask.shape == (5,)
    assert explanation.edge_mask.abs().sum() > 0


@pytest.mark.parametrize("cls", CONVS)
def test_compile_with_ragged_and_unsorted_edges(cls, make):
    conv = make.scramble(cls(5, 8)).eval()
    compiled = torch.compile(conv, dynamic=True, fullgraph=True, backend="eager")
    for degrees in (GRAPHS["ragged"], [4] * 6, [1, 0, 3, 2]):
        x, edge_index = torch.randn(len(degrees), 5), make.random_edges(degrees, len(degrees))
        edge_index = edge_index[:, torch.randperm(edge_index.size(1))]
        with torch.no_grad():
            torch.testing.assert_close(compiled(x, edge_index), conv(x, edge_index), rtol=0, atol=1e-10)


def test_state_dict_and_reset(make):
    conv, other = make.scramble(FeatureGroupingConv(5, 7)), FeatureGroupingConv(5, 7)
    other.load_state_dict(conv.state_dict())
    torch.testing.assert_close(states(conv), states(other), rtol=0, atol=0)
    conv.reset_parameters()
    assert all(not torch.equal(a, b) for a, b in zip(conv.parameters(), other.parameters(), strict=True))
    assert conv.mlp.norms[0].module.running_mean.abs().sum() == 0


@pytest.mark.parametrize("cls", [*CONVS, SurfaceGroupingConv])
def test_takes_in_channels_from_the_first_input(cls):
    torch.manual_seed(3)
    lazy = cls(-1, 8)
    x, edge_index = torch.randn(4, 5), torch.tensor([[3, 1, 0, 2, 2], [1, 0, 1, 1, 3]])
    state = cls(5, 8).state_dict()
    lazy(x, edge_index)
    assert str(lazy) == str(cls(5, 8))
    assert {name: value.shape for name, value in lazy.state_dict().items()} == {
        name: value.shape for name, value in state.items()
    }
    bound = (5 * 2 - 3 * (cls is SurfaceGroupingConv)) ** -0.5
    assert 0 < lazy.mlp.lins[0].weight.abs().max() <= bound  # as PyG draws it
    other = cls(-1, 8)
    other.load_state_dict(state)  # before any input
    expected = cls(5, 8).eval()
    expected.load_state_dict(state)
    torch.testing.assert_close(other.eval()(x, edge_index), expected(x, edge_index), rtol=0, atol=0)
    with pytest.raises(ValueError, match=r"\[num_faces, 5\] \(got \[4, 6\]\)"):
        lazy(torch.randn(4, 6), edge_index)


@pytest.mark.parametrize("cls", CONVS)
def test_a_pair_without_centres_is_one_set_of_features(cls, make):
    conv = make.scramble(cls((5, 5), 8)).eval()
    x, edge_index = torch.randn(4, 5), torch.tensor([[3, 1, 0, 2, 2], [1, 0, 1, 1, 3]])
    torch.testing.assert_close(conv((x, None), edge_index), conv(x, edge_index), rtol=0, atol=0)


def test_repr():
    assert str(NormalGroupingConv(3, 16)) == "NormalGroupingConv(3, 16, hidden_channels=[8, 8])"
    assert str(FeatureGroupingConv((8, 8), 16, [4])) == "FeatureGroupingConv(8, 16, hidden_channels=[4])"


def test_errors():
    with pytest.raises(ValueError, match=r"\[num_faces, 3\] \(got \[4, 5\]\)"):
        NormalGroupingConv(3, 8)(torch.randn(4, 5), torch.zeros(2, 1, dtype=torch.long))
    with pytest.raises(ValueError, match=r"alike for neighbours and centres \(got \(3, 4\)\)"):
        FeatureGroupingConv((3, 4), 8)
