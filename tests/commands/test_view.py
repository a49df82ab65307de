import json
import re

import pytest
import trimesh

from dnf_pyg.cli import main


@pytest.fixture
def opened(monkeypatch):
    """Pages that were opened in a browser."""
    pages = []
    monkeypatch.setattr("webbrowser.open", pages.append)
    return pages


@pytest.fixture
def meshes(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=1)
    for name in ("a.ply", "b.obj"):
        ball.export(tmp_path / name)
    (tmp_path / "other").mkdir()
    trimesh.creation.box().export(tmp_path / "other" / "a.ply")
    return tmp_path


def test_page_without_a_name_is_opened(meshes, opened, capsys):
    assert main(["view", str(meshes / "a.ply")]) == 0
    (page,) = opened
    assert page.startswith("file:///")
    assert page.removeprefix("file://") in capsys.readouterr().out


def test_page_with_a_name_is_written_only(meshes, opened, capsys):
    words = ["view", str(meshes / "a.ply"), str(meshes / "other" / "a.ply"), "-o", str(meshes / "page.html")]
    assert main(words) == 0
    assert opened == []
    page = (meshes / "page.html").read_text()
    assert "80 triangles, 42 vertices" in page
    assert "12 triangles, 8 vertices" in page
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main(["view", str(meshes / "absent.ply")]) == 2


@pytest.mark.parametrize(("words", "toward"), [(["--view", "-x"], [-1, 0, 0]), (["--view=y"], [0, 1, 0])])
def test_first_view_is_along_the_axis_asked_for(words, toward, meshes, opened):
    page = meshes / "page.html"
    assert main(["view", str(meshes / "a.ply"), *words, "-o", str(page)]) == 0
    data = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text(), re.DOTALL)[1])
    assert data["turn"][2::3] == pytest.approx(toward)  # stored column by column: the last row
