"""The command ``dnf-pyg denoise`` from file to file."""

import json
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.nn import DNFNet


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("weights")
    net = DNFNet(k=(4, 6, 8), channels=(8, 8, 8), embedding_channels=8, residual_k=4)
    net.save_pretrained(folder)
    return folder


@pytest.fixture
def noisy_file(tmp_path, cube_mesh):
    pos, face = cube_mesh
    pos = pos + 0.03 * torch.randn(pos.shape, generator=torch.Generator().manual_seed(0), dtype=pos.dtype)
    path = tmp_path / "noisy.ply"
    write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)
    return path


@pytest.fixture
def call(weights, capsys):
    def called(*words):
        options = ["--weights", str(weights), "--patch_size", "200", "--max_excess", "inf"]  # of a random network
        status = main(["denoise", *map(str, words), *options])
        told = capsys.readouterr()
        return status, told.out, told.err

    return called


def test_imports_only_what_it_needs_and_leaves_it_out_of_the_search_for_garbage(weights, noisy_file, tmp_path):
    unneeded = (
        "matplotlib",
        "trimesh",
        "torchmetrics",
        "scipy.spatial",
        "scipy.signal",
        "huggingface_hub",
        "lightning",
    )
    words = ["denoise", str(noisy_file), "-o", str(tmp_path / "out.ply"), "--weights", str(weights)]
    code = (
        "import gc, sys\nfrom dnf_pyg.cli import main\n"
        f"assert main({words}) == 0\n"
        f"assert not set({unneeded}) & set(sys.modules), set({unneeded}) & set(sys.modules)\n"
        "assert gc.isenabled() and gc.get_freeze_count() > 100_000\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.ply").is_file()


def test_json_picture_and_report(call, noisy_file, tmp_path):
    outputs = [tmp_path / name for name in ("out.ply", "out.png", "out.html")]
    words = ("--picture", outputs[1], "--report", outputs[2], "--reference", noisy_file, "--json")
    status, out, _ = call(noisy_file, "-o", outputs[0], *words)
    values = json.loads(out)
    assert status == 0
    assert values["num_faces"] == 768
    assert values["before"]["theta"] == pytest.approx(0, abs=1e-6)
    assert values["after"]["theta"] > 1
    assert 1 <= values["num_iterations"] <= 60
    assert values["ended_by"]
    assert values["flipped_after"] <= values["flipped_before"]
    assert "noisy.ply, denoised" in outputs[2].read_text()
    assert re.search(r"max move</th>\s*<td class=.number.[^>]*>none<", outputs[2].read_text())
    assert outputs[1].read_bytes().startswith(b"\x89PNG")

    status, out, err = call(noisy_file, "-o", outputs[0])
    assert (status, out) == (2, "")
    assert "--overwrite" in err
    assert call(noisy_file, "-o", outputs[0], "--overwrite")[0] == 0


def test_output_beside_the_input_by_default(call, noisy_file, tmp_path):
    assert call(noisy_file)[0] == 0
    assert torch.equal(read_mesh(tmp_path / "noisy_denoised.ply").face, read_mesh(noisy_file).face)
    status, _, err = call(noisy_file)
    assert (status, "noisy_denoised.ply', which exists" in err) == (2, True)
    status, _, err = call(tmp_path)
    assert (status, "Expected -o FOLDER for several inputs" in err) == (2, True)


def test_pages_of_several_inputs_and_their_index(call, noisy_file, tmp_path):
    for name in ("in", "out", "pages"):
        (tmp_path / name).mkdir()
    for name in ("a.ply", "b.ply"):
        (tmp_path / "in" / name).write_bytes(noisy_file.read_bytes())
    assert call(tmp_path / "in", "-o", tmp_path / "out", "--report", tmp_path / "pages")[0] == 0
    assert sorted(path.name for path in (tmp_path / "pages").iterdir()) == ["a.ply.html", "b.ply.html", "index.html"]
    index = (tmp_path / "pages" / "index.html").read_text()
    assert [name in index for name in ('href="a.ply.html"', 'href="b.ply.html"', ">768<")] == [True, True, True]
    status, _, err = call(tmp_path / "in", "-o", tmp_path / "out", "--report", tmp_path / "absent")
    assert (status, "Expected a folder for --report" in err) == (2, True)


def test_names_that_are_not_utf8(call, noisy_file, tmp_path):
    folders = [tmp_path / name for name in ("in", "out", "pages")]
    for folder in folders:
        folder.mkdir()
    name = os.fsdecode(b"a\xff.ply")
    try:
        (tmp_path / "in" / name).write_bytes(noisy_file.read_bytes())
    except OSError:
        pytest.skip("this file system takes names in UTF-8 only")
    status, out, _ = call(tmp_path / "in", "-o", tmp_path / "out", "--report", tmp_path / "pages")
    assert status == 0
    assert r"a\udcff.ply: 768 faces" in out
    assert (tmp_path / "out" / name).is_file()
    assert (tmp_path / "pages" / f"{name}.html").is_file()
    assert r'<a href="a%FF.ply.html">a\udcff.ply</a>' in (tmp_path / "pages" / "index.html").read_text("utf-8")
    page = tmp_path / os.fsdecode(b"\xfe.html")
    assert main(["view", str(tmp_path / "in" / name), str(noisy_file), "-o", str(page)]) == 0
    assert r"a\udcff.ply" in page.read_text("utf-8")


def test_options_from_a_file(call, noisy_file, tmp_path):
    (tmp_path / "many.yaml").write_text("strength: 0.0\nnum_iterations: 3\n")
    assert call(noisy_file, "-o", tmp_path / "out.ply", "-c", tmp_path / "many.yaml")[0] == 0
    assert (tmp_path / "out.ply").read_bytes() == noisy_file.read_bytes()


def test_strength_zero_keeps_the_bytes(call, noisy_file, tmp_path):
    assert call(noisy_file, "-o", tmp_path / "out.ply", "--strength", 0)[0] == 0
    assert (tmp_path / "out.ply").read_bytes() == noisy_file.read_bytes()


def test_mask_from_a_file(call, noisy_file, tmp_path):
    mesh = read_mesh(noisy_file)
    np.savetxt(tmp_path / "mask.txt", mesh.pos[:, 0] > 0, fmt="%d")
    assert call(noisy_file, "-o", tmp_path / "out.ply", "--mask", tmp_path / "mask.txt")[0] == 0
    stays = (read_mesh(tmp_path / "out.ply").pos == mesh.pos).all(dim=1)
    assert stays[mesh.pos[:, 0] <= 0].all()
    assert stays[mesh.pos[:, 0] > 0].double().mean() < 0.2


def test_mask_of_several_meshes_is_a_property_of_each(call, noisy_file, tmp_path):
    mesh = trimesh.load(noisy_file, process=False)
    mesh.vertex_attributes["keep"] = (mesh.vertices[:, 0] > 0).astype(np.float32)
    (tmp_path / "out").mkdir()
    for name in ("a.ply", "b.ply"):
        mesh.export(tmp_path / name)
    assert call(tmp_path / "a.ply", tmp_path / "b.ply", "-o", tmp_path / "out", "--mask", "keep")[0] == 0
    for name in ("a.ply", "b.ply"):
        before, after = read_mesh(tmp_path / name).pos, read_mesh(tmp_path / "out" / name).pos
        assert torch.equal(after[before[:, 0] <= 0], before[before[:, 0] <= 0])
        assert not torch.equal(after, before)


def test_folder_goes_on_after_a_bad_file_and_resumes(call, noisy_file, tmp_path):
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    out.mkdir()
    for name in ("a.ply", "c.ply"):
        (folder / name).write_bytes(noisy_file.read_bytes())
    (folder / "b.ply").write_bytes(noisy_file.read_bytes()[:-50])
    (folder / "notes.txt").write_text("no mesh")
    status, _, err = call(folder, "-o", out)
    assert status == 2
    assert "1 of 3 meshes failed" in err
    assert "b.ply" in err
    assert sorted(path.name for path in out.iterdir()) == ["a.ply", "c.ply"]
    before = (out / "a.ply").stat().st_mtime_ns
    (folder / "b.ply").write_bytes(noisy_file.read_bytes())
    status, _, err = call(folder, "-o", out)
    assert status == 0
    assert err.count("skipped") == 2
    assert (out / "a.ply").stat().st_mtime_ns == before
    assert (out / "b.ply").read_bytes() == (out / "a.ply").read_bytes()


def test_one_input_into_a_folder(call, noisy_file, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / noisy_file.name).write_bytes(b"")
    assert call(noisy_file, "-o", tmp_path / "out")[0] == 2  # not left out in silence, as one of many is
    assert call(noisy_file, "-o", tmp_path / "out", "--overwrite", "--picture", tmp_path / "out" / "a.png")[0] == 0
    assert read_mesh(tmp_path / "out" / noisy_file.name).face.size(1) == 768


def test_input_of_an_unknown_format_is_told_as_such_also_into_a_folder(call, tmp_path):
    (tmp_path / "mesh.ply.gz").write_bytes(b"")
    status, _, err = call(tmp_path / "mesh.ply.gz", "-o", tmp_path)
    assert (status, "Expected a mesh file ending in .obj" in err, "Convert it first." in err) == (2, True, True)


def test_folder_passes_over_what_is_no_mesh_and_names_each_in_warnings(call, noisy_file, tmp_path):
    folder = tmp_path / "in"
    (folder / "old.ply").mkdir(parents=True)
    (folder / "._a.ply").write_bytes(b"left by another system")
    for name in ("a.ply", "b.PLY"):
        (folder / name).write_bytes(noisy_file.read_bytes())
    status, _, err = call(folder, "-o", folder, "--overwrite")  # in place
    assert status == 0
    assert [f"warning: {folder / name}: " in err for name in ("a.ply", "b.PLY", "._a.ply", "old.ply")] == [
        True,
        True,
        False,
        False,
    ]
    assert (folder / "a.ply").read_bytes() != noisy_file.read_bytes()


def test_fault_of_the_program_stops_one_of_many_only(call, noisy_file, tmp_path, monkeypatch):
    trimesh.creation.box().export(tmp_path / "box.ply")
    (tmp_path / "out").mkdir()

    def faulty(path):
        if path.name == "box.ply":
            raise ZeroDivisionError("by a fault")
        return read_mesh(path)

    monkeypatch.setattr("dnf_pyg.commands.denoise.read_mesh", faulty)
    status, _, err = call(tmp_path / "box.ply", noisy_file, "-o", tmp_path / "out")
    assert status == 2
    assert "box.ply: ZeroDivisionError('by a fault')" in err.splitlines()[-1]
    assert [path.name for path in (tmp_path / "out").iterdir()] == [noisy_file.name]


def bad_inputs():
    header = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    return {
        "empty.obj": (b"", "0 bytes"),
        "text.ply": (b"this is no mesh\n", "unreadable"),
        "cloud.ply": (header + b"end_header\n0 0 0\n1 0 0\n0 1 0\n", "point cloud"),
        "nan.obj": (b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
        "far.obj": (b"v 0 0 0\nv 1e39 0 0\nv 0 1 0\nf 1 2 3\n", "1e\\+30"),
        "beyond.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex 8 of 3"),
        "cut.stl": (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "unreadable"),
        "cut.off": (b"OFF\n3 1 0\n0 0 0\n", "unreadable"),
        "cut.glb": (b"glTF\x02\x00\x00\x00\xff\x00\x00\x00", "unreadable"),
        "list.gltf": (b"[1, 2]", "unreadable"),
        "mesh.docx": (b"PK", "ending in"),
    }


@pytest.mark.parametrize("name", bad_inputs())
def test_bad_input_is_one_line_and_writes_nothing(call, tmp_path, name):
    content, text = bad_inputs()[name]
    (tmp_path / name).write_bytes(content)
    status, out, err = call(tmp_path / name, "-o", tmp_path / "out.ply")
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert re.search(text, err), err
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("-o", "absent/out.ply"), "writable folder"),
        (("-o", "out.docx"), "ending in"),
        (("-o", "out.ply", "--mask", "nowhere"), "no file and no property"),
        (("-o", "out.ply", "--device", "cuda:99"), "device of this machine"),
        (("-o", "out.ply", "--reference", "absent.ply"), "does not exist"),
    ],
)
def test_bad_settings_are_one_line_and_write_nothing(call, noisy_file, tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    status, out, err = call(noisy_file, *words)
    assert (status, out) == (2, "")
    assert text in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == [noisy_file.name]


def test_full_disk(call, noisy_file, tmp_path):
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
        status, _, err = call(noisy_file, "-o", tmp_path / "out.ply")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert status == 2
    assert "Free some space" in err
    assert [path.name for path in tmp_path.iterdir()] == [noisy_file.name]


def test_textured_glb_with_seams(call, tmp_path):
    sphere = trimesh.creation.uv_sphere(count=[16, 24])
    soup = trimesh.Trimesh(
        sphere.triangles.reshape(-1, 3), np.arange(3 * len(sphere.faces)).reshape(-1, 3), process=False
    )
    flat = soup.vertices[:, :2] / 2 + 0.5
    soup.visual = trimesh.visual.TextureVisuals(uv=flat, image=Image.new("RGB", (4, 4), "teal"))
    (tmp_path / "noisy.glb").write_bytes(soup.export(file_type="glb", include_normals=True))
    assert call(tmp_path / "noisy.glb", "-o", tmp_path / "out.glb")[0] == 0
    before, after = (read_mesh(tmp_path / f"{name}.glb") for name in ("noisy", "out"))
    assert torch.equal(before.face, after.face)
    _, copies = torch.unique(before.pos, dim=0, return_inverse=True)
    places = torch.unique(torch.cat([copies[:, None].double(), after.pos], dim=1), dim=0)
    assert len(places) == copies.max() + 1  # no crack
    assert not torch.equal(before.pos, after.pos)
    written = trimesh.load_mesh(tmp_path / "out.glb", process=False)
    assert written.visual.material.baseColorTexture.getpixel((0, 0)) == (0, 128, 128)
    np.testing.assert_allclose(written.visual.uv, flat, atol=1e-6)
