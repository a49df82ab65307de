import pytest
import torch

from dnf_pyg.nn import DNFNet, FilteringNetwork, SurfaceDNFNet
from dnf_pyg.nn.config import NETWORKS

SMALL = {"k": (2, 4, 6), "residual_k": 3, "channels": (8, 8, 16), "embedding_channels": 8}


@pytest.mark.parametrize("cls", [DNFNet, SurfaceDNFNet])
def test_gathers_its_inputs_from_a_patch(cls, make):
    data, net = make.patch(9), cls(**SMALL).eval()
    assert tuple(net.gather(data)) == net.inputs
    by_hand = net(**{name: data.get(name) for name in net.inputs})
    torch.testing.assert_close(net(**net.gather(data)), by_hand, rtol=0, atol=0)


@pytest.mark.parametrize("cls", [DNFNet, SurfaceDNFNet])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_takes_patches_of_another_precision(cls, dtype, make):
    data, net = make.patch(9), cls(**SMALL).to(dtype).eval()
    single = data.clone().apply(lambda value: value.float() if value.is_floating_point() else value)
    assert net(**net.gather(single)).dtype == dtype


def test_names_what_a_patch_lacks(make):
    data, net = make.patch(9), SurfaceDNFNet(**SMALL)
    del data.pos, data.area
    with pytest.raises(ValueError, match=r"\(got none of pos, area\)\. Make them with `dnf_pyg.patches"):
        net.gather(data)


def test_arguments_rebuild_the_network():
    for cls in (DNFNet, SurfaceDNFNet):
        net = cls(**SMALL)
        again = cls(**net.arguments)
        assert again.arguments == net.arguments
        again.load_state_dict(net.state_dict())


def test_subclasses_are_known_by_name():
    class Other(DNFNet):
        pass

    assert NETWORKS.pop("Other") is Other
    assert issubclass(NETWORKS["SurfaceDNFNet"], FilteringNetwork)
