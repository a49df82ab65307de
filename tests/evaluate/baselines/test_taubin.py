import torch

from dnf_pyg.evaluate.baselines import (
    BASELINES,
    BilateralNormalFilter,
    GuidedNormalFilter,
    L0Minimization,
    TaubinSmoothing,
    TotalVariationFilter,
)
from dnf_pyg.mesh.geometry import face_normals
from dnf_pyg.mesh.noise import GaussianNormalNoise
from dnf_pyg.mesh.vertex_update import update_vertices


def loop(pos, face, shrink, inflate, num_pairs):
    """Both steps vertex by vertex, with the mean of the neighbours along edges."""
    around = [set() for _ in pos]
    for corners in face.t().tolist():
        for v in corners:
            around[v] |= set(corners) - {v}
    for step in [shrink, -inflate] * num_pairs:
        mean = torch.stack([pos[list(neighbours)].mean(dim=0) for neighbours in around])
        pos = pos + step * (mean - pos)
    return pos


def test_equals_a_loop_over_vertices(sphere_mesh):
    pos, face = sphere_mesh
    pos = GaussianNormalNoise()(pos, face, 0.2, torch.Generator().manual_seed(0))
    result = TaubinSmoothing(num_pairs=3)(pos, face)
    expected = face_normals(loop(pos, face, 0.5, 0.53, 3), face)
    torch.testing.assert_close(result.normal, expected)
    torch.testing.assert_close(result.pos, update_vertices(pos, face, expected, 20))


def test_baselines_by_name_show_their_parameters():
    assert {name: make() for name, make in BASELINES.items()} == {
        "BNF": BilateralNormalFilter(),
        "GNF": GuidedNormalFilter(),
        "TV": TotalVariationFilter(),
        "L0": L0Minimization(),
        "Taubin": TaubinSmoothing(),
    }
    assert (
        repr(BASELINES["L0"]()) == "L0Minimization(strength=0.2, growth=1.414, first_weight=0.001, last_weight=1000.0)"
    )
