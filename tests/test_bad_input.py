"""Every case of the table in docs/bad_input.md: the message is the one printed, one line, status 2, nothing written."""

import contextlib
import errno
import os
import pickle
import re
import shutil
import signal
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from safetensors.torch import load_file, save_file

from dnf_pyg import denoise
from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh
from dnf_pyg.nn import DNFNet
from dnf_pyg.nn.config import describe_network

PAGE = Path(__file__).resolve().parents[1] / "docs" / "bad_input.md"
TINY = {"k": (3, 4, 5), "channels": (8, 8, 8), "embedding_channels": 8, "residual_k": 3}
PLY = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACE = b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"

FILES = {  # case: name and content of the input
    "0-byte file": ("mesh.obj", b""),
    "text file named .ply": ("mesh.ply", b"Dear diary, nothing to see here.\n"),
    "unknown format": ("mesh.docx", b"PK"),
    "point cloud, no faces": ("mesh.ply", PLY + b"end_header\n0 0 0\n1 0 0\n0 1 0\n"),
    "obj cut off in a vertex": ("mesh.obj", CORNERS + b"v 0 1"),
    "ascii ply cut off": ("mesh.ply", PLY + FACE[:-15]),
    "binary ply cut off": ("mesh.ply", PLY.replace(b"ascii", b"binary_little_endian") + FACE[:67] + bytes(20)),
    "ascii stl cut off": ("mesh.stl", b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
    "binary stl cut off": ("mesh.stl", bytes(80) + struct.pack("<I", 100) + bytes(50)),
    "off cut off": ("mesh.off", b"OFF\n3 1 0\n0 0 0\n"),
    "glb cut off": ("mesh.glb", b"glTF\x02\x00\x00\x00\xff\x00\x00\x00"),
    "gltf that is other JSON": ("mesh.gltf", b"[1, 2]"),
    "face of a vertex that does not exist": ("mesh.obj", CORNERS + b"f 1 2 9\n"),
    "coordinate that is no number": ("mesh.obj", CORNERS + b"v nan 0 0\nf 1 2 4\n"),
    "coordinate beyond 1e30": ("mesh.obj", CORNERS + b"v 1e39 0 0\nf 1 2 4\n"),
}


def rows():
    """Case and message of each row of the table; ``…`` stands for anything."""
    found = (re.match(r"\| (.+?) \| `` (.+) `` \|", line) for line in PAGE.read_text().splitlines())
    return {match[1]: match[2] for match in found if match}


@contextlib.contextmanager
def as_nobody():
    """Do without the rights of root, who may write anywhere."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("weights")
    DNFNet(**TINY).save_pretrained(folder)
    for path in (folder, *folder.iterdir()):  # some tests read it without the rights of root
        path.chmod(0o755)
    return folder


@pytest.fixture
def place(tmp_path_factory):
    """Folder with a mesh that other users reach too."""
    folder = tmp_path_factory.mktemp("place")
    for above in (folder, *list(folder.parents)[:3]):
        above.chmod(above.stat().st_mode | 0o055)
    trimesh.creation.icosphere(subdivisions=1).export(folder / "noisy.ply")
    return folder


def damaged(weights, place, change):
    """Copy of the weights with a change."""
    (place / "net").mkdir()
    for file in weights.iterdir():
        (place / "net" / file.name).write_bytes(file.read_bytes())
    change(place / "net" / "model.safetensors")
    return ["--weights", "net"]


def truncate(file):
    file.write_bytes(file.read_bytes()[:-100])


def widen(file):
    state = load_file(file)
    save_file({name: torch.cat([value, value]) if value.dim() else value for name, value in state.items()}, file)


class Malicious:
    def __reduce__(self):
        return (exec, ("raise SystemExit('ran')",))


def prepared(case, place, weights, monkeypatch):
    """Words after ``denoise`` that lead to a case."""
    words = {"input": ["noisy.ply"], "-o": "out.ply", "more": []}
    if case in FILES:
        name, content = FILES[case]
        (place / name).write_bytes(content)
        words["input"] = [name]
    elif case == "file that does not exist":
        words["input"] = ["absent.obj"]
    elif case == "file without permission to read":
        (place / "noisy.ply").chmod(0)
    elif case == "folder without meshes":
        (place / "empty").mkdir()
        words["input"] = ["empty"]
    elif case == "two inputs of one name":
        words["input"] = ["noisy.ply", "../" + place.name + "/noisy.ply"]
    elif case == "output that exists":
        words["-o"] = "noisy.ply"
    elif case == "output folder that does not exist":
        words["-o"] = "absent/out.ply"
    elif case == "output folder without permission to write":
        (place / "locked").mkdir(mode=0o555)
        words["-o"] = "locked/out.ply"
    elif case == "output of an unknown format":
        words["-o"] = "out.docx"
    elif case == "results in the folder of the inputs":
        trimesh.creation.box().export(place / "box.ply")
        words |= {"input": ["noisy.ply", "box.ply"], "-o": "."}
    elif case == "picture of another format":
        words["more"] = ["--picture", "out.jpg"]
    elif case == "option out of range":
        words["more"] = ["--strength", "-1"]
    elif case == "option that does not exist":
        words["more"] = ["--strenght", "1"]
    elif case == "disk full":
        real = os.replace

        def replace(source, target):
            if Path(target).suffix == ".ply":  # compiled code may still be kept
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            real(source, target)

        monkeypatch.setattr(os, "replace", replace)
    elif case == "mask that is not there":
        words["more"] = ["--mask", "nowhere"]
    elif case == "mask that is no numbers":
        (place / "mask.txt").write_text("all of it")
        words["more"] = ["--mask", "mask.txt"]
    elif case == "mask of another length":
        np.savetxt(place / "mask.txt", np.ones(5), fmt="%d")
        words["more"] = ["--mask", "mask.txt"]
    elif case == "reference with other faces":
        trimesh.creation.icosphere(subdivisions=0).export(place / "clean.ply")
        words["more"] = ["--reference", "clean.ply"]
    elif case == "reference without area":
        mesh = trimesh.load(place / "noisy.ply", process=False)
        trimesh.Trimesh(0 * mesh.vertices, mesh.faces, process=False).export(place / "clean.ply")
        words["more"] = ["--reference", "clean.ply"]
    elif case == "device that this machine lacks":
        words["more"] = ["--device", "cuda:99"]
    elif case in ("picture of several inputs", "page of several inputs that is no folder"):
        trimesh.creation.box().export(place / "box.ply")
        more = ["--picture", "a.png"] if case.startswith("picture") else ["--report", "page.html"]
        words |= {"input": ["noisy.ply", "box.ply"], "-o": ".", "more": more}
    elif case == "no output named for several inputs":
        trimesh.creation.box().export(place / "box.ply")
        words["input"] = ["noisy.ply", "box.ply"]
    elif case == "weights of no known name":
        words["more"] = ["--weights", "nonesuch"]
    elif case == "folder without weights":
        (place / "net").mkdir()
        words["more"] = ["--weights", "net"]
    elif case == "weights cut off":
        words["more"] = damaged(weights, place, truncate)
    elif case == "weights of another architecture":
        words["more"] = damaged(weights, place, widen)
    elif case == "checkpoint cut off":
        torch.save({"network": {}, "state_dict": {"a": torch.ones(100)}}, place / "net.ckpt")
        truncate(place / "net.ckpt")
        words["more"] = ["--weights", "net.ckpt"]
    elif case == "checkpoint with code in it":
        (place / "net.ckpt").write_bytes(pickle.dumps({"state_dict": Malicious()}))
        words["more"] = ["--weights", "net.ckpt"]
    elif case == "checkpoint of something else":
        torch.save({"state_dict": {}}, place / "net.ckpt")
        words["more"] = ["--weights", "net.ckpt"]
    else:
        raise AssertionError(f"no test for the case '{case}'")
    if "--weights" not in words["more"]:
        words["more"] += ["--weights", str(weights)]
    output = [] if "no output named" in case else ["-o", words["-o"]]
    return [*words["input"], *output, *words["more"]]


@pytest.mark.parametrize("case", rows())
def test_message_of_the_table(case, place, weights, monkeypatch, capsys):
    monkeypatch.chdir(place)
    words = prepared(case, place, weights, monkeypatch)
    before = sorted(place.rglob("*"))
    place.chmod(0o777)
    with as_nobody() if "permission" in case else contextlib.nullcontext():
        status = main(["denoise", *words])
    captured = capsys.readouterr()
    assert (status, captured.out) == (2, "")
    assert captured.err.count("\n") == 1
    pattern = ".*".join(re.escape(part) for part in rows()[case].split("…"))
    assert re.fullmatch(pattern, captured.err.strip()), captured.err
    assert sorted(place.rglob("*")) == before


def test_small_disk_that_is_really_full(place, weights, monkeypatch, capsys):
    (place / "small").mkdir()
    mounted = shutil.which("mount") and subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", str(place / "small")], capture_output=True
    )
    if not mounted or mounted.returncode:
        pytest.skip("only root may mount the small disk that this test fills")
    try:
        trimesh.creation.icosphere(subdivisions=3).export(place / "large.ply")
        status = main(["denoise", str(place / "large.ply"), "-o", str(place / "small" / "out.ply"),
                       "--weights", str(weights)])  # fmt: skip
        left = list((place / "small").iterdir())
    finally:
        subprocess.run(["umount", str(place / "small")], check=True)
    assert status == 2
    assert "No space left on device" in capsys.readouterr().err
    assert left == []


@pytest.fixture
def heeds_interrupts():
    """A process that was started in the background may have inherited that it ignores them."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeds_interrupts")
@pytest.mark.parametrize("moment", ["filtering", "writing"])
def test_interrupt_leaves_no_file(place, weights, monkeypatch, capsys, moment):
    def interrupt(*_, **__):
        signal.raise_signal(signal.SIGINT)

    filtering = (sys.modules["dnf_pyg.steps"], "filter_normals")
    monkeypatch.setattr(*(filtering if moment == "filtering" else (os, "replace")), interrupt)
    before = sorted(place.rglob("*"))
    status = main(["denoise", str(place / "noisy.ply"), "-o", str(place / "out.ply"), "--weights", str(weights)])
    assert (status, capsys.readouterr().err) == (130, "dnf-pyg: interrupted\n")
    assert sorted(place.rglob("*")) == before


def test_checkpoint_of_other_neighbours_brings_its_own(place, capsys):
    """A network trained with other k than the packaged one runs as it was trained: k comes with the checkpoint."""
    torch.manual_seed(0)
    net = DNFNet(**{**TINY, "k": (2, 6, 9)})
    state = {f"net.{key}": value for key, value in net.state_dict().items()}
    torch.save({"network": describe_network(net), "state_dict": state}, place / "net.ckpt")
    words = ["denoise", str(place / "noisy.ply"), "-o", str(place / "out.ply"), "--weights", str(place / "net.ckpt")]
    assert main(words) == 0
    mesh = trimesh.load(place / "noisy.ply", process=False)
    expected = denoise(mesh, net.eval()).pos
    torch.testing.assert_close(read_mesh(place / "out.ply").pos, expected, rtol=1e-5, atol=1e-6)


def test_table_has_every_file_case():
    assert set(FILES) <= set(rows())
    assert len(rows()) >= 36
