import pytest
import torch

from dnf_pyg.mesh import mean_edge_length
from dnf_pyg.mesh.noise.model import noise_scale


def test_scale_is_a_multiple_of_the_mean_edge_length(sphere_mesh):
    torch.testing.assert_close(noise_scale(*sphere_mesh, 0.3), 0.3 * mean_edge_length(*sphere_mesh))


@pytest.mark.parametrize("level", [-0.1, float("nan"), float("inf")])
def test_rejects_other_levels(level, sphere_mesh):
    with pytest.raises(ValueError, match=r"Expected 'level' as a finite number of at least 0 \(got"):
        noise_scale(*sphere_mesh, level)
