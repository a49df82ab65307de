import contextlib
import gzip
import json
import os

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from dnf_pyg.errors import MeshError, MeshFileError, MeshFileWarning, OutputError
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.mesh.validate import validate_mesh

SUFFIXES = ["obj", "ply", "stl", "off", "glb", "gltf"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip_keeps_order(tmp_path, sphere_mesh, suffix):
    pos, face = sphere_mesh
    path = tmp_path / f"sphere.{suffix}"
    write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, path)
    mesh = read_mesh(path)
    torch.testing.assert_close(mesh.pos[mesh.face], pos[face], rtol=0, atol=1e-6)
    assert mesh.path == path
    assert mesh.pos.dtype == torch.float64

    write_mesh(mesh, 2 * mesh.pos, tmp_path / f"larger.{suffix}")
    larger = read_mesh(tmp_path / f"larger.{suffix}")
    assert torch.equal(larger.face, mesh.face)
    torch.testing.assert_close(larger.pos, 2 * mesh.pos, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "error", "text"),
    [
        ("empty.obj", b"", MeshFileError, "0 bytes"),
        ("text.ply", b"Dear diary, nothing to see here.\n", MeshFileError, r"Expected a \.ply mesh"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", MeshError, "Mesh a point cloud first"),
        ("mesh.docx", b"PK", MeshFileError, r"ending in \.obj"),
        ("packed.ply", gzip.compress(b"ply\n", mtime=0), MeshFileError, r"compressed with gzip\). Unpack it"),
        ("packed.stl", b"PK\x03\x04" + bytes(200), MeshFileError, r"a zip archive\). Unpack it"),
        ("pointer.stl", b"version https://git-lfs.github.com/spec/v1\noid", MeshFileError, r"Git LFS\). Run `git lfs"),
        ("page.obj", b"\n<!DOCTYPE html>\n<html>", MeshFileError, r"a web page\). Download the mesh"),
    ],
)
def test_names_the_fault_of_a_bad_file(tmp_path, name, content, error, text):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(error, match=text):
        read_mesh(tmp_path / name)


def test_missing_file(tmp_path):
    with pytest.raises(MeshFileError, match="does not exist"):
        read_mesh(tmp_path / "absent.ply")


def test_failed_write_leaves_nothing(tmp_path, monkeypatch):
    box = trimesh.creation.box()
    pos = torch.tensor(box.vertices)
    with pytest.raises(OutputError, match="writable folder"):
        write_mesh(box, pos, tmp_path / "absent" / "box.obj")

    def no_space(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(OutputError, match="No space left"):
        write_mesh(box, pos, tmp_path / "box.obj")
    assert list(tmp_path.iterdir()) == []


def test_rejects_another_number_of_positions(tmp_path):
    with pytest.raises(ValueError, match=r"'pos' with 8 vertices \(got 3\)"):
        write_mesh(trimesh.creation.box(), torch.zeros(3, 3), tmp_path / "box.obj")


@pytest.mark.parametrize("source", SUFFIXES)
@pytest.mark.parametrize("target", SUFFIXES)
def test_converts_between_formats(tmp_path, cube_mesh, source, target):
    pos, face = cube_mesh
    write_mesh(trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False), pos, tmp_path / f"cube.{source}")
    mesh = read_mesh(tmp_path / f"cube.{source}")
    write_mesh(mesh, mesh.pos + 1, tmp_path / f"moved.{target}")
    moved = read_mesh(tmp_path / f"moved.{target}")
    torch.testing.assert_close(moved.pos[moved.face], pos[face] + 1, rtol=0, atol=1e-6)


def test_texture_survives_in_another_folder_and_format(tmp_path):
    textured = trimesh.creation.box()
    image = Image.new("RGB", (2, 2), "red")
    textured.visual = trimesh.visual.TextureVisuals(uv=textured.vertices[:, :2] + 0.5, image=image)
    (tmp_path / "out").mkdir()
    textured.export(tmp_path / "box.obj")
    mesh = read_mesh(tmp_path / "box.obj")
    for name in ("box.obj", "box.glb"):
        write_mesh(mesh, 2 * mesh.pos, tmp_path / "out" / name)
        again = trimesh.load_mesh(tmp_path / "out" / name, process=False)
        material = again.visual.material
        picture = material.image if name == "box.obj" else material.baseColorTexture
        assert picture.getpixel((0, 0))[:3] == (255, 0, 0)
        assert again.extents.tolist() == [2, 2, 2]


@pytest.fixture
def triangle(tmp_path):
    """Writes an obj file of one triangle below ``in``, with lines before it, and gives its path."""

    def write(*lines, name="a.obj"):
        path = tmp_path / "in" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join([*lines, "v 0 0 0", "v 1 0 0", "v 0 1 0", "f 1 2 3", ""]))
        return path

    (tmp_path / "out").mkdir()
    return write


def rewrite(path, target):
    mesh = read_mesh(path)
    write_mesh(mesh, mesh.pos + 1, target)
    torch.testing.assert_close(read_mesh(target).pos[:, :3], mesh.pos + 1, rtol=0, atol=1e-6)


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir())


def test_other_files_of_the_user_stay(tmp_path, triangle):
    path = triangle("mtllib wood.mtl")
    (tmp_path / "in" / "wood.mtl").write_text("theirs")
    (tmp_path / "out" / "wood.mtl").write_text("mine")
    for _ in range(2):  # the second time, the copy is there already
        rewrite(path, tmp_path / "out" / "a.obj")
        assert {name: (tmp_path / "out" / name).read_text() for name in files_in(tmp_path / "out")} == {
            "a.obj": (tmp_path / "out" / "a.obj").read_text(),
            "a_wood.mtl": "theirs",
            "wood.mtl": "mine",
        }
        assert (tmp_path / "out" / "a.obj").read_text().startswith("mtllib a_wood.mtl\n")


def test_textures_of_one_name_are_kept_apart(tmp_path):
    (tmp_path / "out").mkdir()
    for room, color in (("a", "red"), ("b", "blue")):
        (tmp_path / room).mkdir()
        square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
        (tmp_path / room / f"{room}.obj").write_text(f"mtllib material.mtl\n{square}")
        (tmp_path / room / "material.mtl").write_text("newmtl m\nmap_Kd texture.png\n")
        Image.new("RGB", (2, 2), color).save(tmp_path / room / "texture.png")
        rewrite(tmp_path / room / f"{room}.obj", tmp_path / "out" / f"{room}.obj")
    for room, color in (("a", (255, 0, 0)), ("b", (0, 0, 255))):
        assert trimesh.load_mesh(tmp_path / "out" / f"{room}.obj").visual.material.image.getpixel((0, 0)) == color
    assert files_in(tmp_path / "out") == ["a.obj", "b.obj", "b_material.mtl", "b_texture.png", "material.mtl",
                                          "texture.png"]  # fmt: skip


def test_face_of_a_vertex_that_does_not_exist(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    with pytest.raises(MeshFileError, match="vertex 3 of 3"):
        read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "gltf"])
@pytest.mark.parametrize("stray", [float("nan"), float("inf"), 1e31])
def test_unused_vertices_without_a_position_stay_as_they_are(tmp_path, suffix, stray):
    points = [(0, 0, 0), (stray, 0, stray), (1, 0, 0), (0, 1, 0)]
    rows = [" ".join(map(str, point)) for point in points]
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    text = {
        "obj": "".join(f"v {row}\n" for row in rows) + "f 1 3 4\n",
        "ply": "\n".join(
            [header + "element face 1\nproperty list uchar int vertex_indices\nend_header", *rows, "3 0 2 3\n"]
        ),
        "off": "\n".join(["OFF", "4 1 0", *rows, "3 0 2 3\n"]),
        "gltf": "",
    }[suffix]
    path = tmp_path / f"a.{suffix}"
    path.write_text(text)
    if suffix == "gltf":
        soup = trimesh.Trimesh(np.array(points), [[0, 2, 3]], process=False)
        write_mesh(soup, torch.tensor(points, dtype=torch.float64), path)
    mesh = read_mesh(path)
    validate_mesh(mesh.pos, mesh.face)
    write_mesh(mesh, mesh.pos + 1, tmp_path / f"moved.{suffix}")
    moved = read_mesh(tmp_path / f"moved.{suffix}")
    torch.testing.assert_close(moved.pos[[0, 2, 3]], mesh.pos[[0, 2, 3]] + 1, rtol=0, atol=1e-9)
    if suffix != "gltf":
        assert rows[1] in (tmp_path / f"moved.{suffix}").read_text()


def test_unreadable_path(tmp_path):
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(MeshFileError, match="Is a directory"):
        read_mesh(tmp_path / "folder.obj")


def test_order_survives_materials_groups_and_polygons_in_another_format(tmp_path, cube_mesh):
    pos, face = cube_mesh
    lines = ["v {} {} {}".format(*point) for point in pos.tolist()] + ["vt 0 0", "vt 1 0", "vt 1 1"]
    for number, corners in enumerate((face.t() + 1).tolist()):  # two materials in turns
        lines += [f"usemtl {'ab'[number % 2]}", "f {}/1 {}/2 {}/3".format(*corners)]
    (tmp_path / "cube.obj").write_text("\n".join(["mtllib cube.mtl", *lines]))
    (tmp_path / "cube.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n")
    mesh = read_mesh(tmp_path / "cube.obj")
    for name in ("cube.glb", "cube.ply", "cube.off", "cube.stl"):
        write_mesh(mesh, mesh.pos + 1, tmp_path / name)
        written = read_mesh(tmp_path / name)
        torch.testing.assert_close(written.pos[written.face], pos[face] + 1, rtol=0, atol=1e-5)
    assert len(read_mesh(tmp_path / "cube.off").pos) == len(pos)  # no texture coordinates there to split vertices

    polygons = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nf 1 2 3 4\nf 2 5 3\n"
    (tmp_path / "mixed.obj").write_text(polygons)
    mesh = read_mesh(tmp_path / "mixed.obj")
    write_mesh(mesh, mesh.pos, tmp_path / "mixed.ply")
    assert read_mesh(tmp_path / "mixed.ply").face.t().tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]


def test_scene_of_several_coloured_meshes(tmp_path):
    scene = trimesh.Scene()
    for number, color in enumerate(([255, 0, 0, 255], [0, 255, 0, 255])):
        box = trimesh.creation.box(extents=(1, 1, 1 + number))
        box.visual.vertex_colors = color
        turn = trimesh.transformations.rotation_matrix(0.3, (1, 2, 3), (number, 0, 0))
        scene.add_geometry(box, node_name=f"{1 - number}", transform=turn)
    scene.export(tmp_path / "scene.glb")
    mesh = read_mesh(tmp_path / "scene.glb")
    for name in ("scene.ply", "scene.gltf", "scene.obj"):
        write_mesh(mesh, 2 * mesh.pos, tmp_path / name)
        written = read_mesh(tmp_path / name)
        torch.testing.assert_close(written.pos, 2 * mesh.pos, rtol=0, atol=1e-5)
        assert torch.equal(written.face, mesh.face)
    assert trimesh.load_mesh(tmp_path / "scene.ply", process=False).visual.vertex_colors[[0, -1]].tolist() == [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
    ]


def test_copies_of_a_mesh_are_counted_before_they_are_made(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.icosphere(subdivisions=3), geom_name="ball")
    tree = json.loads(scene.export(file_type="gltf")["model.gltf"])
    buffers = {name: data for name, data in scene.export(file_type="gltf").items() if name != "model.gltf"}
    for name, data in buffers.items():
        (tmp_path / name).write_bytes(data)
    for copies in (3, 20_000):
        tree["nodes"] = [{"children": list(range(1, copies + 1))}, *({"mesh": 0} for _ in range(copies))]
        tree["scenes"] = [{"nodes": [0]}]
        (tmp_path / f"{copies}.gltf").write_text(json.dumps(tree))
    few, many = (read_mesh(tmp_path / f"{copies}.gltf") for copies in (3, 20_000))
    write_mesh(few, few.pos + 1, tmp_path / "few.ply")
    assert read_mesh(tmp_path / "few.ply").face.size(1) == 3 * 1280
    with pytest.warns(MeshFileWarning, match=r"so often that they have 25,600,000 faces\). Only positions"):
        write_mesh(many, many.pos + 1, tmp_path / "many.ply")
    assert read_mesh(tmp_path / "many.ply").face.size(1) == 1280


def test_gltf_and_glb_are_the_same_in_another_wrapping(tmp_path):
    (tmp_path / "out").mkdir()
    textured = trimesh.creation.box()
    image = Image.new("RGB", (2, 2), "red")
    textured.visual = trimesh.visual.TextureVisuals(uv=textured.vertices[:, :2] + 0.5, image=image)
    textured.export(tmp_path / "box.glb")
    mesh = read_mesh(tmp_path / "box.glb")
    write_mesh(mesh, 2 * mesh.pos, tmp_path / "large.gltf")
    large = read_mesh(tmp_path / "large.gltf")
    write_mesh(large, large.pos / 2, tmp_path / "out" / "small.glb")
    small = read_mesh(tmp_path / "out" / "small.glb")
    torch.testing.assert_close(small.pos, mesh.pos, rtol=0, atol=1e-6)
    trees = [dict(read.document.scene.tree, buffers=None) for read in (mesh, large, small)]
    for tree in trees:
        tree["accessors"] = [{**entry, "min": None, "max": None} for entry in tree["accessors"]]
    assert trees[0] == trees[1] == trees[2]
    material = trimesh.load_mesh(tmp_path / "out" / "small.glb", process=False).visual.material
    assert material.baseColorTexture.getpixel((0, 0))[:3] == (255, 0, 0)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_trimesh_cannot_read_is_converted_without_colours(tmp_path, suffix):
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    (tmp_path / "strips.ply").write_text(header + "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n")
    strips = read_mesh(tmp_path / "strips.ply")
    assert strips.face.t().tolist() == [[0, 1, 2], [2, 1, 3]]
    (tmp_path / "odd.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 x\nf 1/1 2/1 3/1\n")
    odd = read_mesh(tmp_path / "odd.obj")
    write_mesh(strips, strips.pos + 1, tmp_path / f"strips2.{suffix}")
    context = contextlib.nullcontext() if suffix == "obj" else pytest.warns(MeshFileWarning, match="Only positions")
    with context:
        write_mesh(odd, odd.pos + 1, tmp_path / f"odd2.{suffix}")
    for before, name in ((strips, "strips2"), (odd, "odd2")):
        after = read_mesh(tmp_path / f"{name}.{suffix}")
        torch.testing.assert_close(after.pos[after.face], before.pos[before.face] + 1, rtol=0, atol=1e-6)
