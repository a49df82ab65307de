import pytest
import torch

from dnf_pyg.nn.kernels.recompute import EdgeMax
from dnf_pyg.nn.kernels.rows import Rows
from dnf_pyg.nn.neighbors import sort_by_center


@pytest.fixture
def rows(make):
    return Rows.from_sorted(sort_by_center(make.random_edges([3, 2, 3, 2], 5), (5, 4)))


def inputs(hidden):
    """Terms of the first layer, the last weight, then weight, bias, scale and shift of each inner layer."""
    tensors = [torch.randn(4, 6), torch.randn(5, 6), torch.randn(3, [6, *hidden][-1])]
    for width_in, width in zip([6, *hidden], hidden, strict=False):
        tensors += [torch.randn(width, width_in), torch.randn(width), torch.randn(width), torch.randn(width)]
    return [t.requires_grad_() for t in tensors]


@pytest.mark.parametrize("hidden", [[], [5], [5, 7]])
def test_gradcheck(rows, hidden, tiny_blocks):
    def run(*tensors):
        return EdgeMax.apply(rows, [1e-5] * len(hidden), *tensors)[:3]

    assert torch.autograd.gradcheck(run, inputs(hidden))


def test_moments_are_those_of_all_edges(rows, tiny_blocks):
    u, v, weight, *_ = inputs([])
    rows_of = torch.arange(4).repeat_interleave(rows.degree())
    z = (u[rows_of] + v[rows.source]).relu() @ weight.t()
    largest, mean, var = EdgeMax.apply(rows, [], u, v, weight)
    torch.testing.assert_close(largest, torch.stack([z[rows_of == r].amax(dim=0) for r in range(4)]))
    torch.testing.assert_close(mean, z.mean(dim=0))
    torch.testing.assert_close(var, z.var(dim=0, correction=0))


def test_not_a_number_reaches_the_output(rows):
    u, v, weight, *_ = inputs([])
    largest, *_ = EdgeMax.apply(rows, [], u * torch.nan, v, weight)
    assert largest.isnan().all()
    largest.sum().backward()


def test_second_derivatives_are_refused(rows):
    tensors = inputs([])
    (grad,) = torch.autograd.grad(EdgeMax.apply(rows, [], *tensors)[0].square().sum(), tensors[0], create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        grad.sum().backward()
