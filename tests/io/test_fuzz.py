"""Damaged mesh files through the command: one line of ours, soon, and nothing written; or a mesh with as many faces."""

import os
import random
import time
from collections import Counter

import pytest
import torch
import trimesh

from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.nn import Cascade, DNFNet

FILES = int(os.environ.get("DNF_FUZZ_FILES", "600"))  # over all formats; one or two minutes


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


@pytest.fixture
def network(monkeypatch):
    """A network that takes no time, read once."""
    torch.manual_seed(0)
    net = DNFNet(k=(2, 3, 3), channels=(4, 4, 4), embedding_channels=4, residual_k=2).eval()
    monkeypatch.setattr("dnf_pyg.commands.denoise.load_cascade", lambda *_: Cascade([net]))


def test_mutated_files(originals, network, tmp_path, capsys, record_testsuite_property):
    draw = random.Random(int(os.environ.get("DNF_FUZZ_SEED", "0")))
    out = tmp_path / "out"
    out.mkdir()
    names = sorted(originals)
    count, slowest = Counter(), 0.0
    for number in range(FILES):
        name = names[number % len(names)]
        path = tmp_path / f"fuzzed_{name}"
        path.write_bytes(mutated(originals[name], draw))
        start = time.process_time()
        status = main(["denoise", str(path), "-o", str(out / name), "--patch_size", "30", "--num_iterations", "3"])
        slowest = max(slowest, time.process_time() - start)
        told = capsys.readouterr().err
        count[name, status] += 1
        if status == 0:
            assert read_mesh(out / name).face.shape == read_mesh(path).face.shape, (number, name)
            (out / name).unlink()
        else:
            assert status == 2, (number, name)
            assert told.startswith("dnf-pyg: Expected "), (number, name, told)
            assert told.count("\n") == 1, (number, name, told)
            assert list(out.iterdir()) == [], (number, name)
    for (name, status), files in sorted(count.items()):
        record_testsuite_property(f"{name} status {status}", files)
    record_testsuite_property("slowest", f"{slowest:.2f} s")
    assert 0.05 * FILES < sum(files for (_, status), files in count.items() if status == 0) < 0.95 * FILES
    assert slowest < 10
