"""Damaged mesh files: our own errors, soon, and nothing written."""

import os
import random
import time

import pytest
import torch
import trimesh

from dnf_pyg.errors import DNFError
from dnf_pyg.mesh.io import read_mesh, write_mesh
from dnf_pyg.mesh.validate import validate_mesh

FILES = int(os.environ.get("DNF_FUZZ_FILES", "300"))  # over all formats; 2,000 take about a minute


def mutated(data, draw):
    """Flip, cut, repeat, insert or swap a few pieces, more often near the beginning, where the headers are."""
    data = bytearray(data)
    for _ in range(draw.randint(1, 4)):
        place = int(len(data) * draw.random() ** draw.choice((1, 3)))
        length = draw.randint(1, 20)
        match draw.randint(0, 5):
            case 0:
                data[place : place + 1] = bytes([draw.randrange(256)])
            case 1:
                del data[place:]
            case 2:
                data[place:place] = data[place : place + length] * draw.randint(1, 50)
            case 3:
                data[place:place] = bytes(draw.randrange(256) for _ in range(length))
            case 4:
                data[place : place + length] = b"%d" % draw.choice((-1, 0, 2**31 - 1, 2**32, 10**12, 7))
            case 5:
                del data[place : place + length]
    return bytes(data)


@pytest.fixture
def originals(tmp_path):
    box = trimesh.creation.box().subdivide()
    files = {}
    for name in ("a.obj", "a.ply", "a.stl", "a.off", "a.glb", "a.gltf"):
        write_mesh(box, torch.tensor(box.vertices), tmp_path / name)
        files[name] = (tmp_path / name).read_bytes()
    files["ascii.ply"] = box.export(file_type="ply", encoding="ascii")
    files["ascii.stl"] = box.export(file_type="stl_ascii").encode()
    textured = box.copy()
    textured.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2])
    files["seams.obj"] = textured.export(file_type="obj").encode()
    return files


def test_mutated_files(originals, tmp_path):
    draw = random.Random(int(os.environ.get("DNF_FUZZ_SEED", "0")))
    out = tmp_path / "out"
    out.mkdir()
    names = sorted(originals)
    read, slowest, told = 0, 0.0, []
    for number in range(FILES):
        name = names[number % len(names)]
        path = tmp_path / f"fuzzed_{name}"
        path.write_bytes(mutated(originals[name], draw))
        start = time.process_time()
        try:
            mesh = read_mesh(path)
            validate_mesh(mesh.pos, mesh.face)
            read += 1
            write_mesh(mesh, mesh.pos * 1.5, out / name)
            again = read_mesh(out / name)
            assert again.face.shape == mesh.face.shape
            (out / name).unlink()
        except DNFError as error:
            told.append(str(error))
            assert list(out.iterdir()) == [], (number, name)
        slowest = max(slowest, time.process_time() - start)
    assert all(text.startswith("Expected") and "\n" not in text for text in told)
    assert 0.05 * FILES < read < 0.95 * FILES
    assert slowest < 10  # processor seconds: none hangs, however busy the machine is
