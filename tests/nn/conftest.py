"""Plain-loop references of the layers, and random graphs; all in float64."""

from types import SimpleNamespace

import pytest
import torch
from torch_geometric.data import Data


def normalize(h, norm):
    """Batch normalization of the rows of ``h``, statistics of the rows in training and the running ones otherwise."""
    if norm.training:
        mean = sum(h) / len(h)
        var = sum((row - mean) ** 2 for row in h) / len(h)
    else:
        mean, var = norm.running_mean, norm.running_var
    return [(row - mean) / torch.sqrt(var + norm.eps) * norm.weight + norm.bias for row in h]


def mlp_on_rows(mlp, h):
    """MLP with batch normalization and ReLU after every linear layer, row by row."""
    for lin, norm in zip(mlp.lins, mlp.norms, strict=True):
        h = [lin.weight @ row + lin.bias for row in h]
        h = [row.clamp(min=0) for row in normalize(h, norm.module)]
    return h


def edge_mlp_max(mlp, x_src, x_dst, edge_index, subtract):
    """MLP on each edge, then the largest message of each centre; zeros without one."""
    h = []
    for j, i in edge_index.t().tolist():
        h.append(torch.cat([x_dst[i], x_src[j] - x_dst[i] if subtract else x_src[j]]))
    h = mlp_on_rows(mlp, h)
    out = []
    for i in range(len(x_dst)):
        own = [row for row, center in zip(h, edge_index[1].tolist(), strict=True) if center == i]
        out.append(torch.stack(own).max(dim=0).values if own else torch.zeros(mlp.out_channels, dtype=x_dst.dtype))
    return torch.stack(out)


def channel_attention(layer, x, batch):
    """Attention over each patch, batch normalization over the mean and the max of all patches."""
    patches = [x[batch == p] for p in range(int(batch.max()) + 1)]
    pooled = [sum(p) / len(p) for p in patches] + [p.max(dim=0).values for p in patches]
    h = normalize([layer.squeeze.weight @ row + layer.squeeze.bias for row in pooled], layer.squeeze_norm)
    h = [layer.excite.weight @ row.clamp(min=0) + layer.excite.bias for row in h]
    h = normalize(h, layer.excite_norm)
    weight = [torch.sigmoid(h[p] + h[p + len(patches)]) for p in range(len(patches))]
    return torch.stack([row * weight[p] for row, p in zip(x, batch.tolist(), strict=True)])


def nearest_in_features(x, k, batch):
    """The k nearest rows of the same patch for each row, nearest first."""
    edges = []
    for i in range(len(x)):
        same = [j for j in range(len(x)) if batch[j] == batch[i]]
        same.sort(key=lambda j: float(((x[j] - x[i]) ** 2).sum()))
        edges += [(j, i) for j in same[:k]]
    return torch.tensor(edges).t()


def random_edges(degrees, num_sources, generator=None):
    """Edges to centres of the given degrees, sorted by centre."""
    center = torch.arange(len(degrees)).repeat_interleave(torch.tensor(degrees))
    return torch.stack([torch.randint(0, num_sources, center.shape, generator=generator), center])


def patch(num_faces, k=6):
    """Unit normals, places and areas; for each face the edges from itself and k - 1 others, with their ranks."""
    order = torch.rand(num_faces, num_faces).fill_diagonal_(-1).argsort(dim=1)[:, :k]
    return Data(
        x=torch.nn.functional.normalize(torch.randn(num_faces, 3), dim=-1),
        pos=torch.randn(num_faces, 3),
        area=torch.rand(num_faces) + 0.1,
        edge_index=torch.stack([order.flatten(), torch.arange(num_faces).repeat_interleave(order.size(1))]),
        edge_attr=torch.arange(order.size(1)).repeat(num_faces),
    )


def two_patches():
    """Normals of patches of 5 and 4 faces, their edges and the ranks of these, in random order: only ranks count."""
    batch, degrees = torch.tensor([0] * 5 + [1] * 4), [4, 4, 3, 4, 4, 2, 4, 4, 1]
    edge_index = random_edges(degrees, 4)
    edge_index[0] += 5 * batch[edge_index[1]]
    rank = torch.cat([torch.arange(degree) for degree in degrees])
    order = torch.randperm(len(rank))
    return torch.nn.functional.normalize(torch.randn(9, 3), dim=1), edge_index[:, order], rank[order]


def scramble(module):
    """Set every parameter and running statistic to random numbers, scales of either sign among them."""
    for tensor in module.parameters():
        torch.nn.init.uniform_(tensor, -1, 1)
    for name, buffer in module.named_buffers():
        if name.endswith("running_mean"):
            buffer.uniform_(-1, 1)
        if name.endswith("running_var"):
            buffer.uniform_(0.5, 2)
    return module


def gradients(out, tensors):
    """Gradients of a fixed random weighting of ``out``."""
    weight = torch.randn(out.shape, generator=torch.Generator().manual_seed(9), dtype=out.dtype)
    return torch.autograd.grad((out * weight).sum(), tensors, allow_unused=True, materialize_grads=True)


@pytest.fixture
def loops():
    return SimpleNamespace(
        normalize=normalize,
        mlp_on_rows=mlp_on_rows,
        edge_mlp_max=edge_mlp_max,
        channel_attention=channel_attention,
        nearest_in_features=nearest_in_features,
    )


@pytest.fixture
def make():
    return SimpleNamespace(
        random_edges=random_edges, patch=patch, two_patches=two_patches, scramble=scramble, gradients=gradients
    )


@pytest.fixture(autouse=True)
def seeded_float64():
    torch.manual_seed(0)
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


@pytest.fixture
def tiny_blocks(monkeypatch):
    """Blocks of a few edges, so that small graphs take many of them."""
    monkeypatch.setattr("dnf_pyg.nn.kernels.rows.BLOCK_NUMBERS", {"cpu": 100})
