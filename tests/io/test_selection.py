import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg.errors import MeshFileError
from dnf_pyg.io import read_mesh
from dnf_pyg.io.selection import read_selection


@pytest.fixture
def box(tmp_path):
    made = trimesh.creation.box()
    made.vertex_attributes["keep"] = np.arange(8, dtype=np.float32) % 2
    made.face_attributes["part"] = (np.arange(12) == 3).astype(np.float32)
    made.export(tmp_path / "box.ply")
    return read_mesh(tmp_path / "box.ply")


def test_values_per_vertex_and_per_face(box, tmp_path):
    (tmp_path / "vertex.txt").write_text("0 1 0 1\n0 1\n0 1\n")
    (tmp_path / "words.csv").write_text("False,True\n" * 4)
    np.save(tmp_path / "face.npy", np.arange(12) == 3)
    assert read_selection(tmp_path / "vertex.txt", box).tolist() == [False, True] * 4
    assert read_selection(tmp_path / "words.csv", box).tolist() == [False, True] * 4
    expected = torch.zeros(8, dtype=torch.bool)
    expected[box.face[:, 3]] = True
    assert torch.equal(read_selection(tmp_path / "face.npy", box), expected)
    assert torch.equal(read_selection("part", box), expected)
    assert read_selection("keep", box).tolist() == [False, True] * 4


def test_says_what_is_wrong(box, tmp_path):
    (tmp_path / "short.txt").write_text("1 0 1")
    (tmp_path / "words.txt").write_text("all of it")
    (tmp_path / "nan.txt").write_text("nan " * 8)
    np.save(tmp_path / "pickle.npy", np.array([{}], dtype=object))
    np.save(tmp_path / "pairs.npy", np.zeros(8, dtype=[("a", "f4"), ("b", "f4")]))
    np.savez(tmp_path / "packed.npz", np.zeros(8))
    (tmp_path / "packed.npz").rename(tmp_path / "packed.npy")
    for digits in (10, 30):
        np.save(tmp_path / f"{digits}.npy", np.zeros(8))
        content = (tmp_path / f"{digits}.npy").read_bytes()
        number = b"(1" + digits * b"0" + b",)"
        (tmp_path / f"{digits}.npy").write_bytes(
            content.replace(b"(8,), }" + (len(number) - 4) * b" ", number + b", }")
        )
    for source, text in (
        (tmp_path / "short.txt", r"one number per vertex \(8\) or triangle \(12\) \(got 3"),
        (tmp_path / "words.txt", "could not convert"),
        (tmp_path / "nan.txt", "got NaN"),
        (tmp_path / "pickle.npy", "Python objects"),
        (tmp_path / "pairs.npy", "Cannot cast"),
        (tmp_path / "packed.npy", "magic string"),
        (tmp_path / "10.npy", "greater than file size"),
        (tmp_path / "30.npy", "Expected a mask of numbers"),
        ("absent", "no file and no property"),
    ):
        with pytest.raises(MeshFileError, match=text):
            read_selection(source, box)


def test_attribute_of_a_glb_mesh(tmp_path):
    scene = trimesh.Scene()
    for number in range(2):
        made = trimesh.creation.box(extents=(1, 1, 1 + number))
        made.vertex_attributes["_keep" if number else "_other"] = np.arange(8, dtype=np.float32) % 2
        made.vertex_attributes["_where"] = made.vertices.astype(np.float32)
        scene.add_geometry(made)
    for name in ("scene.glb", "scene.gltf"):
        data = scene.export(file_type=name[6:])
        files = data if isinstance(data, dict) else {name: data}
        for inside, content in files.items():
            (tmp_path / inside.replace("model.gltf", name)).write_bytes(content)
        mesh = read_mesh(tmp_path / name)
        assert read_selection("keep", mesh).tolist() == [False] * 8 + [False, True] * 4
        with pytest.raises(MeshFileError, match="3 numbers per vertex"):
            read_selection("_where", mesh)
