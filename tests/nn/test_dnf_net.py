import pytest
import torch

from dnf_pyg.nn import DNFNet


def random_patch(num_faces, k, seed=0):
    """Unit normals and, for each face, itself and k - 1 other faces."""
    generator = torch.Generator().manual_seed(seed)
    normal = torch.nn.functional.normalize(torch.randn(num_faces, 3, generator=generator), dim=-1)
    order = torch.rand(num_faces, num_faces, generator=generator).fill_diagonal_(-1).argsort(dim=1)[:, :k]
    center = torch.arange(num_faces).repeat_interleave(k)
    return normal, torch.stack([order.flatten(), center])


def small_net(**kwargs):
    torch.manual_seed(0)
    arguments = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8} | kwargs
    return DNFNet(**arguments)


@pytest.mark.parametrize(("num_units", "count"), [(1, 286_419), (2, 361_686), (3, 436_953)])
def test_parameter_counts(num_units, count):
    assert sum(p.numel() for p in DNFNet(num_units=num_units).parameters()) == count


@pytest.mark.parametrize("align", [False, True])
def test_stages_and_forward_agree(align):
    normal, edge_index = random_patch(20, 6)
    net = small_net(align=align).eval()
    stages = net.stages(normal, edge_index)
    assert len(stages) == 2
    assert [tuple(r.shape) for _, r in stages] == [(20, 8)] * 2
    torch.testing.assert_close(net(normal, edge_index), stages[-1][0])
    torch.testing.assert_close(stages[0][0].norm(dim=1), torch.ones(20))


def test_config_and_pretrained_round_trip(tmp_path):
    net = small_net(align=True).eval()
    net.save_pretrained(tmp_path)
    loaded = DNFNet.from_pretrained(tmp_path).eval()
    assert DNFNet(**net.config).config == loaded.config == net.config
    normal, edge_index = random_patch(20, 6)
    torch.testing.assert_close(loaded(normal, edge_index), net(normal, edge_index), rtol=0, atol=0)
