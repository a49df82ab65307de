import pytest
import torch
from torch.nn import functional as F

from dnf_pyg.nn import JointBilateralConv

EDGE_INDEX = torch.tensor([[0, 1, 2, 1, 0, 2, 0, 3], [0, 0, 0, 1, 1, 2, 2, 3]])


@pytest.fixture
def conv():
    torch.manual_seed(0)
    conv = JointBilateralConv(8, guidance_channels=4, num_iterations=3)
    torch.nn.init.normal_(conv.sharpness.weight, std=0.3)
    torch.nn.init.normal_(conv.guidance.weight, std=0.3)
    return conv


@pytest.fixture
def normal():
    return F.normalize(torch.randn(4, 3, generator=torch.Generator().manual_seed(1)), dim=1)


@pytest.fixture
def x():
    return torch.randn(4, 8, generator=torch.Generator().manual_seed(2))


def loop(conv, normal, x, area):
    """One face and one edge at a time."""
    q, sharpness = conv.guidance(x), conv.sharpness(x)
    first, current = normal, normal
    for _ in range(conv.num_iterations):
        rows = []
        for i in range(len(normal)):
            total = torch.zeros(3)
            for j in EDGE_INDEX[0, EDGE_INDEX[1] == i]:
                exponent = ((first[i] - first[j]) ** 2).sum() * sharpness[i] ** 2 + ((q[i] - q[j]) ** 2).sum()
                total = total + area[j] * torch.exp(-exponent) * current[j]
            rows.append(total / total.norm())
        current = torch.stack(rows)
    return current


def test_repr(conv):
    assert str(conv) == "JointBilateralConv(8, num_iterations=3)"


def test_value(conv, normal, x):
    out = conv(normal, x, EDGE_INDEX)
    torch.testing.assert_close(out, loop(conv, normal, x, torch.ones(4)))


def test_large_faces_weigh_more(conv, normal, x):
    area = torch.tensor([[2.0], [0.5], [1.0], [3.0]])
    out = conv(normal, x, EDGE_INDEX, area)
    torch.testing.assert_close(out, loop(conv, normal, x, area.squeeze(1)))
    torch.testing.assert_close(out, conv(normal, x, EDGE_INDEX, 7 * area))


def test_order_of_edges_does_not_matter(conv, normal, x):
    shuffled = EDGE_INDEX[:, torch.randperm(EDGE_INDEX.size(1), generator=torch.Generator().manual_seed(4))]
    torch.testing.assert_close(conv(normal, x, shuffled), conv(normal, x, EDGE_INDEX))


def test_face_alone_stays(conv, normal, x):
    torch.testing.assert_close(conv(normal, x, EDGE_INDEX)[3], normal[3])


def test_turns_with_the_normals(conv, normal, x):
    turn, _ = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(3)))
    torch.testing.assert_close(conv(normal @ turn, x, EDGE_INDEX), conv(normal, x, EDGE_INDEX) @ turn)


def test_equal_features_average_a_plane():
    """On a noisy plane the result is nearer to the plane than any input."""
    conv = JointBilateralConv(8, num_iterations=10)
    generator = torch.Generator().manual_seed(0)
    normal = F.normalize(torch.tensor([0.0, 0.0, 1.0]) + 0.05 * torch.randn(30, 3, generator=generator), dim=1)
    every = torch.cartesian_prod(torch.arange(30), torch.arange(30)).t().flip(0)
    out = conv(normal, torch.zeros(30, 8), every)
    assert float(out[:, 2].min()) > 0.999
    assert float(normal[:, 2].min()) < 0.995


def test_gradients_reach_every_parameter(conv, normal, x):
    conv(normal.requires_grad_(), x.requires_grad_(), EDGE_INDEX)[:, 0].sum().backward()
    for value in (normal, x, *conv.parameters()):
        assert value.grad is not None
        assert (
            value.grad.abs().sum() > 0 or value is conv.guidance.bias
        )  # a shift of the guidance changes no difference
