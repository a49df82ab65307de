import json

import pytest
import trimesh

from dnf_pyg.datasets import checks
from dnf_pyg.datasets.checks import find_faults


@pytest.fixture
def files(tmp_path):
    """A sound mesh, one with other faces, one with a coordinate that is no number, and one that is no mesh."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    sphere.export(tmp_path / "sound.obj")
    trimesh.creation.box().export(tmp_path / "other.obj")
    text = (tmp_path / "sound.obj").read_text()
    first = next(line for line in text.splitlines() if line.startswith("v "))
    (tmp_path / "nan.obj").write_text(text.replace(first, "v nan 0 0"))
    (tmp_path / "text.obj").write_text("no mesh")
    return {path.stem: path for path in tmp_path.glob("*.obj")}


def test_names_every_fault(files, tmp_path):
    sound = files["sound"]
    pairs = [(None, sound), (sound, sound), (sound, files["other"]), (None, files["nan"]), (files["text"], sound)]
    found = find_faults(pairs, tmp_path)
    assert list(found) == pairs[2:]
    reasons = list(found.values())
    assert reasons[0] == "80 and 12 faces, or the same in another order"
    assert "nan.obj" in reasons[1]
    assert "text.obj" in reasons[2]


def test_reads_again_only_what_changed(files, tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(checks, "read_mesh", lambda path, real=checks.read_mesh: read.append(path.name) or real(path))
    pairs = [(None, files["sound"]), (None, files["text"])]
    assert list(find_faults(pairs, tmp_path)) == pairs[1:]
    assert list(find_faults(pairs, tmp_path)) == pairs[1:]
    assert read == ["sound.obj", "text.obj"]
    files["text"].write_bytes(files["sound"].read_bytes())
    assert find_faults(pairs, tmp_path) == {}
    assert read == ["sound.obj", "text.obj", "text.obj"]
    (tmp_path / "processed" / "checked.json").write_text(json.dumps([1]))  # damaged: no reason to fail
    assert find_faults(pairs, tmp_path) == {}
