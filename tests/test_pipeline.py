import copy
import math
from contextlib import nullcontext

import numpy as np
import pytest
import torch
import trimesh
from torch_geometric.data import Data

from dnf_pyg import FAST, DenoiseWarning, FilterOptions, MeshError, OptionError, UpdateOptions, denoise
from dnf_pyg.filtering import filter_normals
from dnf_pyg.io import MeshFile, read_mesh
from dnf_pyg.mesh import edges, face_normals
from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.nn import SurfaceDNFNet


@pytest.fixture(scope="module")
def net():
    """A small network with weights as drawn: what it makes of normals is wrong, but the same wherever they are."""
    torch.manual_seed(0)
    net = SurfaceDNFNet(k=(4, 6, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4)
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


def run(mesh, net, *, update=None, num_passes=1, mask=None, progress=None, **filtering):
    options = FilterOptions(**{"patch_size": 200, "precision": "fp32", **filtering})
    limits = {"max_excess": math.inf}  # what a random network does is never explained
    update = UpdateOptions(**(limits | (update or {})))
    return denoise(mesh, net, filtering=options, update=update, num_passes=num_passes, mask=mask, progress=progress)


def test_result(noisy, net):
    before = noisy.vertices.copy()
    result = run(noisy, net)
    assert (noisy.vertices == before).all()
    assert (result.mesh.faces == noisy.faces).all()
    assert result.coverage.min() >= 2
    assert bool((result.confidence > 0).all() and (result.confidence <= 1 + 1e-6).all())
    torch.testing.assert_close(result.normal.norm(dim=1), torch.ones(len(noisy.faces)))
    assert result.flipped_after <= result.flipped_before
    assert 0.05 < result.noise.level < 0.3
    assert set(result.seconds) == {"prepare", "patches", "network", "fuse", "update"}
    assert torch.equal(result.pos, run(noisy, net).pos)


def test_result_says_how_the_update_ended_in_the_log_too(noisy, net, caplog):
    with caplog.at_level("INFO", logger="dnf_pyg"):
        result = run(noisy, net, update={"num_iterations": 2, "early_stopping": "never"})
    assert (result.num_iterations, result.ended_by) == (2, "the largest number was reached")
    assert caplog.messages[-1].startswith("denoised 768 faces")
    assert caplog.messages[-1].endswith("2 iterations: the largest number was reached")


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_error_of_the_progress_function_ends_the_work_and_changes_nothing(noisy, net, error):
    before, calls = noisy.vertices.copy(), []

    def cancel(done, total):
        calls.append(done)
        raise error("enough")

    with pytest.raises(error, match="enough"):
        run(noisy, net, progress=cancel, batch_size=1)
    assert len(calls) == 1
    assert (noisy.vertices == before).all()


def test_automatic_precision_is_one_of_the_two(noisy, net, monkeypatch):
    full, half = (run(noisy, net, precision=precision).pos for precision in ("fp32", "bf16"))
    assert not torch.equal(full, half)
    for has_instructions, expected in ((False, full), (True, half)):
        monkeypatch.setattr("torch.cpu._is_amx_tile_supported", lambda: False)
        monkeypatch.setattr("torch.cpu._is_avx512_bf16_supported", lambda has=has_instructions: has)
        assert torch.equal(run(noisy, net, precision="auto", device="cpu").pos, expected)


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
    assert torch.equal(run(noisy, net, update={"strength": 0.0}).pos, start)
    half = run(noisy, net, update={"strength": 0.5}).pos
    torch.testing.assert_close(half, start.lerp(full, 0.5))
    limited = (run(noisy, net, update={"max_move": 0.05, "strength": 0.5}).pos - start).norm(dim=1) / edge_length(noisy)
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
    assert torch.equal(run(opened, net, update={"preserve_boundary": True}).pos[boundary], start[boundary])


def test_copies_of_a_vertex_move_together(noisy, net):
    soup = trimesh.Trimesh(
        noisy.triangles.reshape(-1, 3), torch.arange(3 * len(noisy.faces)).view(-1, 3), process=False
    )
    expected = run(noisy, net, smoothing=0.0).pos[noisy.faces.flatten()]
    torch.testing.assert_close(run(soup, net, smoothing=0.0).pos, expected, rtol=0, atol=1e-9)
    smoothed = run(noisy, net).pos[noisy.faces.flatten()]  # the estimate of the noise depends a little on their order
    torch.testing.assert_close(run(soup, net).pos, smoothed, rtol=0, atol=1e-3)


def test_copies_that_differ_in_their_last_digits_get_one_position(noisy, net):
    corners = noisy.triangles.reshape(-1, 3)
    near = corners + 1e-7 * np.random.default_rng(0).standard_normal(corners.shape)
    soup = near, np.arange(len(near)).reshape(-1, 3)
    result = run(soup, net)
    torch.testing.assert_close(result.pos, run(noisy, net).pos[noisy.faces.flatten()], rtol=0, atol=1e-3)
    first = torch.zeros(len(noisy.vertices), dtype=torch.long)
    first[noisy.faces.flatten()] = torch.arange(len(near))
    moved = (result.pos != torch.tensor(near)).any(dim=1)
    assert moved.double().mean() > 0.9
    assert torch.equal(result.pos[moved], result.pos[first[noisy.faces.flatten()]][moved])
    still = run(soup, net, update={"strength": 0.0})
    assert np.array_equal(still.vertices, near)  # what does not move keeps its digits


def test_winding_of_the_faces_does_not_matter(noisy, net):
    faces = np.asarray(noisy.faces)
    mixed = np.where(np.arange(len(faces))[:, None] % 10 == 0, faces[:, [0, 2, 1]], faces)
    doubled = np.concatenate([faces, faces[:, [0, 2, 1]]])
    expected = run(noisy, net)
    for changed, text in ((mixed, "wound the other way than their neighbours: 77"), (doubled, "same vertices.*: 768")):
        with pytest.warns(DenoiseWarning, match=text):
            result = run((np.asarray(noisy.vertices), changed), net)
        torch.testing.assert_close(result.pos, expected.pos)
        assert np.array_equal(result.face.t().numpy(), changed)
        assert len(result.coverage) == len(result.confidence) == len(changed)
        own = face_normals(result.pos, result.face)[:768], face_normals(expected.pos, expected.face)
        sign = (own[0] * own[1]).sum(dim=1).round()
        torch.testing.assert_close(result.normal[:768], expected.normal * sign[:, None].float())


def test_repeats_on_its_own_result(noisy, net):
    seen = []
    twice = run(noisy, net, num_passes=2, progress=lambda done, total: seen.append(done / total))
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
    with pytest.warns(DenoiseWarning, match="below 0.03") as caught:
        assert any("below 0.03" in text for text in run(clean, net).warnings)
    assert caught[0].filename == __file__
    assert not any("noise level" in text for text in run(noisy, net).warnings)
    monkeypatch.setattr(net, "noise_range", (0.0, 0.01))
    with pytest.warns(DenoiseWarning, match=r"above 0.01.*Use two passes"):
        run(noisy, net)
    monkeypatch.setattr(net, "noise_range", None)  # unknown: nothing to warn of
    assert not any("noise level" in text for text in run(noisy, net).warnings)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"num_passes": 0}, r"'num_passes' to be a whole number of at least 1 \(got 0\)"),
        ({"mask": torch.ones(3, dtype=torch.bool)}, r"'mask' of shape \[386\] and type bool \(got \[3\]"),
        ({"k": (2, 3)}, r"'k' with 3 numbers, one for each level of the network \(got \(2, 3\)\)"),
    ],
)
def test_rejects_wrong_settings(noisy, net, settings, text):
    with pytest.raises(OptionError, match=text):
        run(noisy, net, **settings)


def test_rejects_meshes_it_cannot_take(noisy, net):
    with pytest.raises(MeshError, match="0 faces"):
        run(trimesh.Trimesh(vertices=[[0, 0, 0]]), net)
    noisy.vertices[7] = float("nan")
    with pytest.raises(MeshError, match="finite"):
        run(noisy, net)


def test_fast_leaves_out_patches_and_neighbours(noisy, net):
    usual, fast = run(noisy, net), denoise(noisy, net, filtering=FAST)
    assert fast.coverage.min() >= 1
    assert fast.coverage.double().mean() < usual.coverage.double().mean()
    every = run(noisy, net, k=(4, 6, 8))
    torch.testing.assert_close(every.pos, usual.pos)  # as many as the network has
    assert not torch.allclose(run(noisy, net, k=(2, 3, 4)).normal, usual.normal, atol=1e-5)


def test_growth_is_the_callers_choice(noisy, net):
    by_default, dijkstra, heat = (run(noisy, net, patch_size=100, **how) for how in (
        {}, {"growth": "dijkstra"}, {"growth": "heat"}))  # fmt: skip
    torch.testing.assert_close(by_default.pos, dijkstra.pos)
    assert not torch.equal(heat.normal, dijkstra.normal)  # other patches
    assert int(heat.coverage.min()) >= 2


def state_of(net):
    modes = [module.training for module in net.modules()]
    tensors = {name: (value.device, value.dtype, value.clone()) for name, value in net.state_dict().items()}
    return modes, tensors


def assert_same_state(net, before):
    modes, tensors = state_of(net)
    assert modes == before[0]
    for name, (device, dtype, value) in before[1].items():
        assert tensors[name][:2] == (device, dtype), name
        torch.testing.assert_close(tensors[name][2], value, rtol=0, atol=0)


def test_network_in_training_mode_is_used_in_evaluation_mode_and_left_alone(noisy, net):
    expected = run(noisy, net)
    other = copy.deepcopy(net).train()
    other.embedding.eval()  # modes may be mixed
    before = state_of(other)
    assert torch.equal(run(noisy, other).normal, expected.normal)
    assert_same_state(other, before)


def test_network_is_left_alone_when_denoising_fails(noisy, net):
    other = copy.deepcopy(net).train()
    before = state_of(other)

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(noisy, other, progress=interrupt)
    assert_same_state(other, before)


def test_network_stays_on_its_device(noisy, net, monkeypatch):
    """The meta device stands in for a GPU: only where the network ran is looked at."""
    before, devices = state_of(net), []

    def forward(self, x, **inputs):
        devices.append((x.device.type, next(self.parameters()).device.type))
        return torch.ones(x.shape, device="cpu")

    monkeypatch.setattr(type(net), "forward", forward)
    monkeypatch.setattr(torch, "autocast", lambda *_, **__: nullcontext())  # not for meta
    run(noisy, net, device="meta")
    assert set(devices) == {("meta", "meta")}
    assert_same_state(net, before)


def test_network_in_double_precision(noisy, net):
    expected = run(noisy, net)
    double = copy.deepcopy(net).double()
    result = run(noisy, double)
    assert next(double.parameters()).dtype == torch.float64
    torch.testing.assert_close(result.normal, expected.normal, atol=1e-3, rtol=0)
    assert result.normal.dtype == torch.float32


def test_default_dtype_and_device_of_torch_do_not_matter(noisy, net, tmp_path):
    net.save_pretrained(tmp_path / "net")
    expected = run(noisy, net)
    try:
        torch.set_default_dtype(torch.float64)
        torch.set_default_device("meta")
        results = run(noisy, net), run(noisy, tmp_path / "net")
    finally:
        torch.set_default_dtype(torch.float32)
        torch.set_default_device(None)
    for result in results:
        torch.testing.assert_close(result.pos, expected.pos)
        assert (result.normal.dtype, result.normal.device.type) == (torch.float32, "cpu")


def test_validates_once_and_computes_edges_once(noisy, net, monkeypatch):
    calls = []
    for module in ("pipeline", "mesh.facet_graph"):
        monkeypatch.setattr(f"dnf_pyg.{module}.validate_mesh", lambda *_: calls.append("validate"))
    for module in ("mesh.geometry", "mesh.topology"):
        monkeypatch.setattr(f"dnf_pyg.{module}.edges", lambda face: calls.append("edges") or edges(face))
    run(noisy, net, num_passes=2)
    assert sorted(calls) == ["edges", "validate"]


def test_filter_normals_gives_what_denoise_fits(noisy, net):
    pos, face = positions(noisy), torch.tensor(noisy.faces).t().contiguous()
    fused = filter_normals(net, pos, face, FilterOptions(patch_size=200, precision="fp32"))
    torch.testing.assert_close(fused.normal, run(noisy, net, smoothing=0.0).normal)
    with pytest.raises(MeshError, match="0 faces"):
        filter_normals(net, pos, face[:, :0])


def test_result_is_of_the_kind_given_and_is_written(noisy, net, tmp_path):
    expected = run(noisy, net).pos
    noisy.export(tmp_path / "noisy.ply")
    vertices, faces = np.asarray(noisy.vertices)[:, ::-1][:, ::-1], np.asarray(noisy.faces)[:, ::-1][:, ::-1]
    assert faces.strides[1] > 0
    for mesh, kind in (
        (tmp_path / "noisy.ply", MeshFile),
        (str(tmp_path / "noisy.ply"), MeshFile),
        ((vertices, faces), tuple),
        (Data(pos=positions(noisy).float(), face=torch.tensor(noisy.faces).t()), Data),
        (trimesh.Scene(noisy), trimesh.Scene),
    ):
        result = run(mesh, net)
        assert type(result.mesh) is kind
        torch.testing.assert_close(result.pos, expected, rtol=0, atol=1e-4)
        assert np.array_equal(result.vertices, result.pos.numpy())
        result.save(tmp_path / "out.ply")
        torch.testing.assert_close(read_mesh(tmp_path / "out.ply").pos, result.pos, rtol=0, atol=1e-5)


def test_faces_with_negative_strides(noisy, net):
    turned = np.asarray(noisy.faces)[:, ::-1]
    assert turned.strides[1] < 0
    result = run((np.asarray(noisy.vertices), turned), net)
    assert torch.equal(result.pos, run((np.asarray(noisy.vertices), turned.copy()), net).pos)


def test_bar_of_progress(noisy, net, capfd):
    run(noisy, net, progress=True)
    assert "filtering" in capfd.readouterr().err
    run(noisy, net)
    assert capfd.readouterr().err == ""


def test_local_noise_is_measured_only_for_a_limit(noisy, net, monkeypatch):
    def fail(*args):
        raise AssertionError

    monkeypatch.setattr("dnf_pyg.pipeline.LocalNoise", fail)
    assert run(noisy, net).left_alone == 0
    with pytest.raises(AssertionError):
        run(noisy, net, update={"max_excess": 1.6})
