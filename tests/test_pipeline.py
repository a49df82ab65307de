import pytest
import torch
import trimesh

from dnf_pyg import FAST, MeshError, WeightsError, denoise
from dnf_pyg.mesh import DijkstraGrowth, HeatGrowth
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.nn import DNFNet


@pytest.fixture(scope="module")
def net():
    """A small network with weights as drawn: what it makes of normals is wrong, but the same wherever they are."""
    torch.manual_seed(0)
    net = DNFNet(k=(4, 6, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4, align=True)
    return net.eval()


@pytest.fixture
def noisy(cube_mesh):
    pos, face = cube_mesh
    pos = pos + 0.03 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    return trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)


def positions(mesh):
    return torch.tensor(mesh.vertices, dtype=torch.float64)


def edge_length(mesh):
    return float(mean_edge_length(positions(mesh), torch.tensor(mesh.faces).t()))


def run(mesh, net, **settings):
    return denoise(mesh, net, **{"patch_size": 200, **settings})


def test_result(noisy, net):
    before = noisy.vertices.copy()
    result = run(noisy, net)
    assert (noisy.vertices == before).all()
    assert (result.mesh.faces == noisy.faces).all()
    assert result.coverage.min() >= 2
    assert bool((result.confidence > 0).all() and (result.confidence <= 1 + 1e-6).all())
    torch.testing.assert_close(result.normal.norm(dim=1), torch.ones(len(noisy.faces)))
    assert result.flipped_after <= result.flipped_before
    assert 0.05 < result.noise_level < 0.3
    assert set(result.seconds) == {"prepare", "patches", "network", "fuse", "update"}
    assert torch.equal(result.pos, run(noisy, net).pos)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scales_with_the_mesh(noisy, net, scale):
    larger = noisy.copy()
    larger.vertices = scale * noisy.vertices
    difference = (run(larger, net).pos / scale - run(noisy, net).pos).norm(dim=1).max() / edge_length(noisy)
    assert difference < 1e-4


def test_moves_and_turns_with_the_mesh(noisy, net):
    turn = torch.tensor(trimesh.transformations.rotation_matrix(1.0, (1, 2, 3)))[:3, :3]
    turned = noisy.copy()
    turned.vertices = (positions(noisy) @ turn.t() + 100).numpy()
    difference = ((run(turned, net).pos - 100) @ turn - run(noisy, net).pos).norm(dim=1) / edge_length(noisy)
    assert difference.quantile(0.98) < 1e-4
    assert difference.max() < 0.1  # rounding may decide which of two faces is a neighbour, or whether a face folds


def test_strength_and_limit(noisy, net):
    full = run(noisy, net).pos
    start = positions(noisy)
    assert torch.equal(run(noisy, net, strength=0.0).pos, start)
    half = run(noisy, net, strength=0.5).pos
    torch.testing.assert_close(half, start.lerp(full, 0.5))
    limited = (run(noisy, net, max_move=0.05, strength=0.5).pos - start).norm(dim=1) / edge_length(noisy)
    assert 0.04 < limited.max() <= 0.05 + 1e-9


def test_mask_and_boundary(noisy, net):
    start = positions(noisy)
    mask = start[:, 0] > 0
    masked = run(noisy, net, mask=mask).pos
    assert torch.equal(run(noisy, net, mask=mask.numpy()).pos, masked)
    moved = (masked != start).any(dim=1)
    assert not moved[~mask].any()
    assert moved[mask].double().mean() > 0.9

    opened = trimesh.Trimesh(noisy.vertices, noisy.faces[20:], process=False)
    edge = trimesh.grouping.group_rows(opened.edges_sorted, require_count=1)
    boundary = torch.tensor(opened.edges[edge].flatten())
    start = positions(opened)
    assert (run(opened, net).pos != start)[boundary].any()
    assert torch.equal(run(opened, net, preserve_boundary=True).pos[boundary], start[boundary])


def test_copies_of_a_vertex_move_together(noisy, net):
    soup = trimesh.Trimesh(
        noisy.triangles.reshape(-1, 3), torch.arange(3 * len(noisy.faces)).view(-1, 3), process=False
    )
    torch.testing.assert_close(run(soup, net).pos, run(noisy, net).pos[noisy.faces.flatten()], rtol=0, atol=1e-9)


def test_repeats_on_its_own_result(noisy, net):
    seen = []
    twice = run(noisy, net, repeat=2, progress=lambda done, total: seen.append(done / total))
    assert not torch.equal(twice.pos, run(noisy, net).pos)
    assert seen == sorted(seen)
    assert seen[-1] == 1


def test_keeps_texture_and_colours(net):
    box = trimesh.creation.box().subdivide().subdivide()
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2])
    assert (run(box, net).mesh.visual.uv == box.visual.uv).all()


def test_warns_outside_of_what_was_trained(noisy, net, cube_mesh, monkeypatch):
    monkeypatch.setattr(net, "noise_range", (0.03, 0.45))
    clean = trimesh.Trimesh(cube_mesh[0].numpy(), cube_mesh[1].t().numpy(), process=False).subdivide()
    assert any("below 0.03" in text for text in run(clean, net).warnings)
    wild = noisy.copy()
    wild.vertices = (
        wild.vertices + 0.5 * torch.randn(wild.vertices.shape, generator=torch.Generator().manual_seed(1)).numpy()
    )
    assert any("above 0.45" in text for text in run(wild, net).warnings)
    assert not any("noise level" in text for text in run(noisy, net).warnings)
    monkeypatch.setattr(net, "noise_range", None)  # unknown: nothing to warn of
    assert not any("noise level" in text for text in run(wild, net).warnings)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"strength": 1.5}, r"'strength' from 0 to 1 \(got 1.5\)"),
        ({"repeat": 0}, r"'repeat' of at least 1 \(got 0\)"),
        ({"mask": torch.ones(3, dtype=torch.bool)}, r"'mask' of shape \[386\] and bool \(got \[3\]"),
        ({"max_move": -1.0}, "'max_move' of at least 0"),
        ({"min_coverage": 0}, "'min_coverage' of at least 1"),
        ({"batch_size": 0}, r"'batch_size' of at least 1 \(got 0\)"),
        ({"precision": torch.float16}, r"'precision' torch.float32 or torch.bfloat16 \(got torch.float16\)"),
    ],
)
def test_rejects_wrong_settings(noisy, net, settings, text):
    with pytest.raises(ValueError, match=text):
        run(noisy, net, **settings)


def test_rejects_meshes_it_cannot_take(noisy, net):
    with pytest.raises(MeshError, match="0 faces"):
        run(trimesh.Trimesh(vertices=[[0, 0, 0]]), net)
    with pytest.raises(MeshError, match=r"'mesh' as a trimesh.Trimesh \(got Scene\): read it with trimesh.load_mesh"):
        run(trimesh.Scene(noisy), net, mask=None)
    noisy.vertices[7] = float("nan")
    with pytest.raises(MeshError, match="finite"):
        run(noisy, net)


def test_fast_leaves_out_patches_and_neighbours(noisy, net):
    usual, fast = run(noisy, net), run(noisy, net, **FAST)
    assert fast.coverage.min() >= 1
    assert fast.coverage.double().mean() < usual.coverage.double().mean()
    every = run(noisy, net, neighbors=(4, 6, 8))
    torch.testing.assert_close(every.pos, usual.pos)  # as many as the network has
    assert not torch.allclose(run(noisy, net, neighbors=(2, 3, 4)).normal, usual.normal, atol=1e-5)
    with pytest.raises(WeightsError, match=r"network of 2 levels for 'neighbors' \(2, 3\) \(got one of 3\)"):
        run(noisy, net, neighbors=(2, 3))


def test_growth_is_the_callers_choice(noisy, net):
    by_default, dijkstra, heat = (
        denoise(noisy, net, patch_size=100, growth=growth) for growth in (None, DijkstraGrowth(), HeatGrowth())
    )
    torch.testing.assert_close(by_default.pos, dijkstra.pos)
    assert not torch.equal(heat.normal, dijkstra.normal)  # other patches
    assert int(heat.coverage.min()) >= 2
