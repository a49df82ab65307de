import pytest
import torch
from torch_geometric.data import Batch

from dnf_pyg.nn import SurfaceDNFNet


def small_net(**kwargs):
    arguments = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8}
    return SurfaceDNFNet(**{**arguments, "bilateral_iterations": 2, **kwargs})


def test_the_bilateral_filter_is_the_last_stage(make):
    data, net = make.patch(20), make.scramble(small_net()).eval()
    stages = net.stages(**net.gather(data))
    assert [tuple(residual.shape) for _, residual in stages] == [(20, 8), (20, 8), (20, 0)]
    nearest = data.edge_index[:, data.edge_attr < 2]
    frame_free = [normal for normal, _ in stages]
    torch.testing.assert_close(net(**net.gather(data)), frame_free[-1])
    assert nearest.size(1) == 40
    for normal in frame_free:
        torch.testing.assert_close(normal.norm(dim=1), torch.ones(20))


def test_moves_scales_and_turns_with_the_mesh(make):
    data, net = make.patch(15), make.scramble(small_net()).eval()
    expected = net(**net.gather(data))
    turn = torch.linalg.qr(torch.randn(3, 3)).Q
    moved = data.clone()
    moved.x, moved.pos, moved.area = data.x @ turn.t(), 7 * data.pos @ turn.t() + 5, 49 * data.area
    torch.testing.assert_close(net(**net.gather(moved)), expected @ turn.t(), rtol=0, atol=1e-8)
    moved.pos = torch.randn(15, 3)
    assert not torch.allclose(net(**net.gather(moved)), expected @ turn.t())


@pytest.mark.parametrize("sizes", [[12, 12], [12, 2, 7]])
def test_batch_equals_each_patch_alone(sizes, make):
    net, patches = make.scramble(small_net()).eval(), [make.patch(size) for size in sizes]
    alone = torch.cat([net(**net.gather(data)) for data in patches])
    out = net(**net.gather(Batch.from_data_list(patches)))
    torch.testing.assert_close(out, alone, rtol=0, atol=1e-10)


def test_order_of_edges_does_not_matter(make):
    data, net = make.patch(15), make.scramble(small_net()).eval()
    torch.testing.assert_close(net(**net.gather(data.clone().coalesce())), net(**net.gather(data)), rtol=0, atol=1e-10)


def test_gradients_reach_every_parameter(make):
    net, batch = small_net().train(), Batch.from_data_list([make.patch(12), make.patch(9)])
    sum((normal - batch.x).square().sum() for normal, _ in net.stages(**net.gather(batch))).backward()
    assert all(p.grad is not None and torch.isfinite(p.grad).all() for p in net.parameters())


def test_autocast_keeps_directions_precise(make):
    data, net = make.patch(30), small_net().float().eval()
    with torch.autocast("cpu", torch.bfloat16):
        for normal, _ in net.stages(**net.gather(data)):
            assert normal.dtype == torch.float32
            torch.testing.assert_close(normal.norm(dim=1), torch.ones(30).float())


def test_reset_and_errors(make):
    net = make.scramble(small_net())
    net.reset_parameters()
    assert net.bilateral.sharpness.bias.tolist() == [4.0]
    for name in ("num_units", "bilateral_iterations"):
        with pytest.raises(ValueError, match=rf"'{name}' to be positive \(got 0\)"):
            small_net(**{name: 0})


def test_its_normals_need_less_smoothing_as_a_later_network():
    assert (small_net().smoothing, small_net(num_earlier=2).smoothing) == (0.2, 0.05)


def test_further_normals_turn_with_the_mesh_and_change_the_result(make):
    data, net = make.patch(15), make.scramble(small_net(num_earlier=2)).eval()
    assert net.inputs[-1] == "earlier"
    data.earlier = torch.nn.functional.normalize(torch.randn(15, 2, 3, dtype=data.x.dtype), dim=2)
    expected = net(**net.gather(data))
    turn = torch.linalg.qr(torch.randn(3, 3, dtype=data.x.dtype)).Q
    moved = data.clone()
    moved.x, moved.pos, moved.earlier = data.x @ turn.t(), data.pos @ turn.t(), data.earlier @ turn.t()
    torch.testing.assert_close(net(**net.gather(moved)), expected @ turn.t(), rtol=0, atol=1e-8)
    moved.earlier = moved.earlier.flip(1)
    assert not torch.allclose(net(**net.gather(moved)), expected @ turn.t())
    del data.earlier
    with pytest.raises(ValueError, match="got none of earlier"):
        net.gather(data)
