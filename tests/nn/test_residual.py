import pytest
import torch

from dnf_pyg.nn import ResidualUnit


@pytest.mark.parametrize("sizes", [[8], [6, 6], [2, 7, 1]])
@pytest.mark.parametrize("training", [False, True])
def test_matches_loops(sizes, training, loops, make):
    unit = make.scramble(ResidualUnit(5, k=3)).train(training)
    batch = torch.arange(len(sizes)).repeat_interleave(torch.tensor(sizes))
    x = torch.randn(sum(sizes), 5, requires_grad=True)
    edge_index = loops.nearest_in_features(x, 3, batch)
    expected = loops.edge_mlp_max(unit.conv.mlp, x, x, edge_index, subtract=True)
    expected_grads = make.gradients(expected, [x, *unit.parameters()])
    out = unit(x, batch)
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-10)
    torch.testing.assert_close(make.gradients(out, [x, *unit.parameters()]), expected_grads, rtol=0, atol=1e-10)


def test_repr_and_reset(make):
    unit = make.scramble(ResidualUnit(8, k=3))
    assert str(unit) == "ResidualUnit(8, k=3)"
    unit.reset_parameters()
    assert unit.conv.mlp.norms[0].module.weight.tolist() == [1.0] * 8


def test_needs_a_neighbour():
    with pytest.raises(ValueError, match=r"of a residual unit of at least 1 \(got 0\)\. Raise it\."):
        ResidualUnit(8, k=0)
