"""A first result without a mesh of one's own."""

import torch

from dnf_pyg.cli import main
from dnf_pyg.commands.demo import noisy_scan
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import boundary_vertices


def test_part_and_scan_are_denoised_and_shown(tmp_path, capsys):
    folder = tmp_path / "new" / "demo"
    assert main(["demo", "-o", str(folder), "--faces", "4000"]) == 0
    told = capsys.readouterr().out
    for name in ("part", "scan"):
        assert f"picture: {folder / name}.png" in told
        assert f"page in 3D: {folder / name}.html" in told
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert "<html" in (folder / f"{name}.html").read_text()
        noisy, denoised = (read_mesh(folder / f"{name}_{kind}.ply") for kind in ("noisy", "denoised"))
        assert torch.equal(noisy.face, denoised.face)
    theta = [float(line.split()[-2]) for line in told.splitlines() if "theta of the" in line]
    assert len(theta) == 6
    assert theta[2] < theta[0] / 2
    assert theta[5] < theta[3] / 2
    assert main(["demo", "-o", str(folder)]) == 2
    assert "Expected a new folder" in capsys.readouterr().err


def test_scan_is_open_faces_the_viewer_and_has_the_faces_asked_for():
    clean, noisy, face = noisy_scan(3000)
    assert abs(face.size(1) - 3000) < 300
    assert boundary_vertices(face, len(clean)).any()
    a, b, c = clean[face]
    assert torch.linalg.cross(b - a, c - a)[:, 2].min() > 0
    assert 0.01 < (noisy - clean).norm(dim=1).mean() < 1  # pixels
