"""What a mesh file from a stranger may write: only files beside the output, under names that are free."""

import base64
import json
import os

import pytest
import torch
import trimesh
from PIL import Image

from dnf_pyg.errors import MeshFileWarning
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.io.copies import Copies
from dnf_pyg.io.folder import CompanionError

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def place(tmp_path):
    """Folders for an input and an output, beside a file that nobody may touch."""
    for name in ("in", "out", "away"):
        (tmp_path / name).mkdir()
    (tmp_path / "victim.png").write_text("precious")
    yield tmp_path
    assert (tmp_path / "victim.png").read_text() == "precious"
    assert list((tmp_path / "away").iterdir()) == []


def rewrite(source, target):
    mesh = read_mesh(source)
    write_mesh(mesh, mesh.pos + 1, target)


def names_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def textured(name, color="red"):
    box = trimesh.creation.box()
    material = trimesh.visual.material.PBRMaterial(name=name, baseColorTexture=Image.new("RGB", (2, 2), color))
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2] + 0.5, material=material)
    return box


@pytest.mark.parametrize("name", ["../victim", "{}/victim", "..\\victim", "a\nmtllib ../victim", "wood", "", None])
def test_materials_get_names_of_our_own(place, name):
    textured(name and name.format(place)).export(place / "in" / "a.glb")
    rewrite(place / "in" / "a.glb", place / "out" / "box.obj")
    assert names_in(place / "out") == ["box.mtl", "box.obj", "box_material.png"]
    text = (place / "out" / "box.obj").read_text()
    assert [line for line in text.splitlines() if line.startswith(("mtllib", "usemtl", "o "))] == [
        "mtllib box.mtl",
        "usemtl box_material",
    ]
    image = trimesh.load_mesh(place / "out" / "box.obj", process=False).visual.material.image
    assert image.getpixel((0, 0))[:3] == (255, 0, 0)


def test_materials_of_one_name_do_not_share_a_texture(place):
    for color in ("red", "blue"):
        textured("wood", color).export(place / "in" / f"{color}.glb")
        rewrite(place / "in" / f"{color}.glb", place / "out" / f"{color}.obj")
    pixels = [
        trimesh.load_mesh(place / "out" / f"{color}.obj", process=False).visual.material.image.getpixel((0, 0))[:3]
        for color in ("red", "blue")
    ]
    assert pixels == [(255, 0, 0), (0, 0, 255)]


def test_files_of_the_user_are_never_replaced(place):
    textured("wood").export(place / "in" / "a.glb")
    for name in ("a.mtl", "a_material.png"):
        (place / "out" / name).write_text("mine")
    for _ in range(2):
        rewrite(place / "in" / "a.glb", place / "out" / "a.obj")
    assert names_in(place / "out") == ["a.mtl", "a.obj", "a_a.mtl", "a_a_material.png", "a_material.png"]
    assert (place / "out" / "a.mtl").read_text() == (place / "out" / "a_material.png").read_text() == "mine"
    image = trimesh.load_mesh(place / "out" / "a.obj", process=False).visual.material.image
    assert image.getpixel((0, 0))[:3] == (255, 0, 0)


@pytest.mark.parametrize("name", ["b.obj", "B.OBJ", ".bashrc", ".hidden.mtl", "run.sh", "page.html", "a.ply"])
def test_only_materials_pictures_and_buffers_are_copied(place, name):
    (place / "in" / name).write_text(TRIANGLE)
    (place / "in" / "a.obj").write_text(f"mtllib {name}\n{TRIANGLE}")
    with pytest.warns(MeshFileWarning, match="does not end in .mtl"):
        rewrite(place / "in" / "a.obj", place / "out" / "a.obj")
    assert names_in(place / "out") == ["a.obj"]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../victim.png", "outside the folder"),
        ("{}/victim.png", "absolute path"),
        ("link.png", "link that leaves"),
        ("pipe.png", "not a regular file"),
        ("absent.png", "does not exist"),
        ("\x1b[2J.png", r"'\\x1b\[2J.png', but it does not exist"),  # nothing that a terminal would act on
    ],
)
@pytest.mark.parametrize("kind", ["obj", "ply", "gltf"])
def test_what_is_not_copied_is_named(place, name, reason, kind):
    name = name.format(place)
    (place / "in" / "link.png").symlink_to(place / "victim.png")
    os.mkfifo(place / "in" / "pipe.png")
    source, target = (place / folder / f"a.{kind}" for folder in ("in", "out"))
    if kind == "obj":
        source.write_text(f"mtllib a.mtl\n{TRIANGLE}")
        (place / "in" / "a.mtl").write_text(f"newmtl a\nmap_Kd {name}\n")
    elif kind == "ply":
        data = trimesh.creation.box().export(file_type="ply", encoding="ascii")
        source.write_bytes(data.replace(b"element vertex", f"comment TextureFile {name}\nelement vertex".encode(), 1))
    else:
        write_mesh(trimesh.creation.box(), torch.tensor(trimesh.creation.box().vertices), source)
        source.write_text(json.dumps({**json.loads(source.read_text()), "images": [{"uri": name}]}))
    with pytest.warns(MeshFileWarning, match=reason):
        rewrite(source, target)
    assert names_in(place / "out") == (["a.mtl", "a.obj"] if kind == "obj" else [f"a.{kind}"])


def test_a_library_that_refers_to_itself_is_copied_once(place):
    (place / "in" / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}")
    (place / "in" / "a.mtl").write_text("map_Kd a.mtl\n")
    with pytest.warns(MeshFileWarning, match="'a.mtl', but its name does not end in .png"):
        rewrite(place / "in" / "a.obj", place / "out" / "a.obj")
    assert names_in(place / "out") == ["a.mtl", "a.obj"]


def test_buffers_are_read_below_the_folder_only(place):
    trimesh.creation.box().export(place / "in" / "a.glb")
    tree = json.loads(read_mesh(place / "in" / "a.glb").document.as_gltf())
    content = base64.b64decode(tree["buffers"][0]["uri"].split(",")[1])
    (place / "secret.bin").write_bytes(content)
    tree["buffers"][0]["uri"] = "../secret.bin"
    (place / "in" / "b.gltf").write_text(json.dumps(tree))
    with pytest.raises(
        OSError, match=r"buffer '../secret.bin' cannot be read, since it lies outside .* beside the mesh"
    ):
        read_mesh(place / "in" / "b.gltf")


def test_nothing_is_written_through_a_link(place):
    (place / "in" / "p").mkdir()
    (place / "in" / "p" / "x.mtl").write_text("newmtl a\n")
    (place / "in" / "y.mtl").write_text("newmtl b\n")
    (place / "out" / "p").symlink_to(place / "away")
    (place / "out" / "y.mtl").symlink_to(place / "away" / "y.mtl")
    (place / "in" / "a.obj").write_text(f"mtllib p/x.mtl\nmtllib y.mtl\n{TRIANGLE}")
    with pytest.warns(MeshFileWarning, match=r"'p/x.mtl', but '.*out/p' in the folder of the result is a link"):
        rewrite(place / "in" / "a.obj", place / "out" / "a.obj")
    assert names_in(place / "out") == ["a.obj", "a_y.mtl", "p", "y.mtl"]
    assert (place / "out" / "a.obj").read_text().startswith("mtllib p/x.mtl\nmtllib a_y.mtl\n")


def test_conversion_reads_no_picture_elsewhere(place):
    box = textured("a")
    box.export(place / "in" / "a.obj")
    library = next((place / "in").glob("*.mtl"))
    Image.new("RGB", (2, 2), "blue").save(place / "private.png")
    for name, reason in (("../private.png", "outside"), (f"{place}/private.png", "absolute path")):
        library.write_text(f"newmtl a\nmap_Kd {name}\n")
        with pytest.warns(MeshFileWarning, match=reason):
            rewrite(place / "in" / "a.obj", place / "out" / "a.glb")
        assert b"PNG" not in (place / "out" / "a.glb").read_bytes()


@pytest.mark.parametrize("kind", ["glb", "gltf"])
def test_picture_beside_a_scene_gets_another_name_where_it_is_taken(place, kind):
    write_mesh(trimesh.creation.box(), torch.tensor(trimesh.creation.box().vertices), place / "in" / "a.gltf")
    tree = json.loads((place / "in" / "a.gltf").read_text())
    (place / "in" / "a.gltf").write_text(json.dumps({**tree, "images": [{"uri": "my%20wood.png"}]}))
    (place / "in" / "my wood.png").write_text("theirs")
    (place / "out" / "my wood.png").write_text("mine")
    rewrite(place / "in" / "a.gltf", place / "out" / f"b.{kind}")
    assert (place / "out" / "b_my wood.png").read_text() == "theirs"
    assert (place / "out" / "my wood.png").read_text() == "mine"
    assert read_mesh(place / "out" / f"b.{kind}").document.scene.tree["images"] == [{"uri": "b_my%20wood.png"}]


def test_attributes_cannot_change_the_header_of_a_ply(place):
    box = trimesh.creation.box()
    box.vertex_attributes["_a\nelement face 7"] = box.vertices[:, 0].astype("f4")
    box.export(place / "in" / "a.glb")
    rewrite(place / "in" / "a.glb", place / "out" / "a.ply")
    assert len(read_mesh(place / "out" / "a.ply").face.t()) == 12


def test_names_in_pictures_and_libraries_in_folders(place):
    (place / "in" / "mat").mkdir()
    (place / "in" / "a.obj").write_text(f"mtllib mat\\a.mtl\n{TRIANGLE}")
    (place / "in" / "mat" / "a.mtl").write_text("newmtl a\nmap_Kd wood.png\nmap_Ks beside.png\n")
    (place / "in" / "mat" / "wood.png").write_text("wood")
    (place / "in" / "beside.png").write_text("beside")
    rewrite(place / "in" / "a.obj", place / "out" / "a.obj")
    assert names_in(place / "out") == ["a.obj", "beside.png", "mat", "mat/a.mtl", "mat/wood.png"]


def test_a_failed_write_leaves_no_copy(place):
    (place / "in" / "mat").mkdir()
    (place / "in" / "mat" / "a.mtl").write_text("newmtl a\n")
    (place / "in" / "a.obj").write_text(f"mtllib mat/a.mtl\n{TRIANGLE}")
    (place / "out" / "b.obj").mkdir()
    with pytest.raises(OSError, match="Is a directory"):
        rewrite(place / "in" / "a.obj", place / "out" / "b.obj")
    assert names_in(place / "out") == ["b.obj"]


def test_names_run_out(tmp_path):
    copies = Copies(tmp_path / "a.obj")
    (tmp_path / "x.mtl").write_text("other")
    assert [copies.add("x.mtl", str(number).encode()) for number in range(3)] == ["a_x.mtl", "a2_x.mtl", "a3_x.mtl"]
    with pytest.raises(CompanionError, match="too many"):
        [copies.add("x.mtl", b"%d" % number) for number in range(100)]
