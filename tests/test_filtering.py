import pytest
import torch

from dnf_pyg import FilterOptions
from dnf_pyg.filtering import filter_normals, on_cpu
from dnf_pyg.mesh import filled_face_normals
from dnf_pyg.nn import SurfaceDNFNet
from dnf_pyg.nn.config import NETWORKS

SMALL = {"k": (3, 5), "residual_k": 4, "channels": (8, 8), "embedding_channels": 8}
OPTIONS = FilterOptions(patch_size=100, precision="fp32")


def test_further_normals_reach_the_network_face_by_face(cube_mesh):
    pos, face = cube_mesh
    given = filled_face_normals(pos, face)
    earlier = torch.stack([given.flip(0), given], dim=1)

    class Second(SurfaceDNFNet):
        def stages(self, x, pos, area, edge_index, edge_attr=None, batch=None, earlier=None):
            return [(earlier[:, 1], x)]

    net = Second(**SMALL, num_earlier=2).eval()
    del NETWORKS["Second"]
    fused = filter_normals(net, pos, face, OPTIONS, earlier=earlier)
    torch.testing.assert_close(fused.normal.double(), given, rtol=0, atol=1e-6)
    with pytest.raises(ValueError, match="got none of earlier"):
        filter_normals(net, pos, face, OPTIONS)


def test_default_device_is_the_cpu_inside():
    with torch.device("meta"), on_cpu():
        assert torch.zeros(1).device.type == "cpu"
