import pytest
import torch

from dnf_pyg import FilterOptions
from dnf_pyg.filtering import filter_normals, on_cpu
from dnf_pyg.mesh import filled_face_normals
from dnf_pyg.nn import DNFNet, SurfaceDNFNet
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


class Recorder(DNFNet):
    """Gives back the normals as they are, and keeps them."""

    def stages(self, x, edge_index, edge_attr=None, batch=None):
        self.seen.append((x, batch))
        return [(x, x)]


del NETWORKS["Recorder"]


@pytest.mark.parametrize("random_rotation", [True, False])
def test_patches_are_rotated_at_random_where_the_training_did_so(random_rotation, cube_mesh):
    """The network sees rotated normals, each patch by a rotation of its own, and its result is rotated back."""
    pos, face = cube_mesh
    net = Recorder(**SMALL).eval()
    net.random_rotation, net.seen = random_rotation, []
    fused = filter_normals(net, pos, face, OPTIONS)
    torch.testing.assert_close(fused.normal.double(), filled_face_normals(pos, face), rtol=0, atol=1e-6)
    x, batch = net.seen[0]
    for patch in range(int(batch.max()) + 1):
        axes = x[batch == patch].abs().amax(dim=1)
        assert (bool((axes < 0.999).any())) == random_rotation  # the normals of a cube are axes otherwise
    again = filter_normals(net, pos, face, OPTIONS)
    assert torch.equal(again.normal, fused.normal)


def test_default_device_is_the_cpu_inside():
    with torch.device("meta"), on_cpu():
        assert torch.zeros(1).device.type == "cpu"
