"""Every fault in the second table of docs/bad_input.md, from file to file: same faces, finite positions, status 0."""

import json
import re
from pathlib import Path

import pytest
import torch
import trimesh

from dnf_pyg.cli import main
from dnf_pyg.io import read_mesh, write_mesh
from dnf_pyg.nn import DNFNet

PAGE = Path(__file__).resolve().parents[1] / "docs" / "bad_input.md"
CORNERS = torch.tensor([[0, 1, 5], [1, 6, 5]])
START = torch.tensor([5 * row + column for row in range(4) for column in range(4)])
FACE = (START[:, None, None] + CORNERS).reshape(-1, 3).t()  # 32 faces on 5 x 5 vertices
POS = torch.tensor([[x, y, 0.3 * ((3 * x + 7 * y) % 4)] for y in range(5) for x in range(5)], dtype=torch.float64)
APART = torch.cat([POS, POS + 50])


def joined(*faces):
    return torch.cat([FACE, *(torch.tensor(face).t() for face in faces)], dim=1)


def degenerate():
    pos = POS.clone()
    pos[7] = pos[6]
    return pos, FACE


MESHES = {
    "open boundary": [(POS, FACE)],
    "several components, isolated faces": [(APART, joined([[25, 26, 30], [40, 41, 46]])), (POS, FACE[:, [0, 9, 30]])],
    "edge with three or more faces, bow-tie vertex": [
        (APART, joined([[0, 1, 30], [0, 1, 40], [24, 44, 45]])),
        (APART, torch.cat([FACE, torch.where(FACE == 0, 24, FACE + 25)], dim=1)),
    ],
    "zero-area face": [degenerate(), (POS * torch.tensor([1.0, 0, 0]), FACE)],
    "face with a repeated vertex": [(POS, joined([[3, 3, 9], [4, 4, 4]]))],
    "duplicate faces": [(POS, torch.cat([FACE, FACE[:, :9], FACE[[1, 2, 0], :4], FACE[[0, 2, 1], :4]], dim=1))],
    "duplicate vertices (seams, stl)": [(POS[FACE.t().flatten()], torch.arange(FACE.numel()).view(-1, 3).t())],
    "unreferenced vertices": [(torch.cat([POS[:5] + 90, POS]), FACE + 5)],
    "inconsistently oriented faces": [(POS, torch.cat([FACE[:, ::2], FACE[[0, 2, 1], 1::2]], dim=1))],
    "flat, tiny, huge, or far from the origin": [
        (change(POS), FACE)
        for change in (
            lambda p: p * torch.tensor([1.0, 1, 0]),
            lambda p: 1e-6 * p,
            lambda p: 1e6 * p,
            lambda p: p + 1e6,
        )
    ],
    "mesh smaller than a patch, single triangle": [(POS[:3] + 0.1 * POS[5:8], torch.tensor([[0], [1], [2]]))],
    "polygons in obj, ply and off": [],
    "all vertices at one point": [(torch.full_like(POS, 3.0), FACE)],
}


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("weights")
    DNFNet(k=(3, 4, 5), channels=(8, 8, 8), embedding_channels=8, residual_k=3).save_pretrained(folder)
    return folder


@pytest.fixture
def denoised(tmp_path, weights, capsys):
    def run(source, *more):
        output = tmp_path / f"out{source.suffix}"
        words = [source, "-o", output, "--weights", weights, "--patch_size", "20", "--max_excess", "inf", "--json"]
        status = main(["denoise", *map(str, [*words, "--overwrite", *more])])
        told = capsys.readouterr()
        assert status == 0, told.err
        json.loads(told.out, parse_constant=pytest.fail)  # NaN is no JSON
        return read_mesh(source), read_mesh(output)

    return run


def test_table_and_tests_agree():
    text = PAGE.read_text().split("## What is accepted")[1]
    assert re.findall(r"^\| (?!fault|---)(.+?) \|", text, re.MULTILINE) == list(MESHES)


@pytest.mark.parametrize(
    ("pos", "face"), [pytest.param(*mesh, id=fault) for fault, meshes in MESHES.items() for mesh in meshes]
)
def test_fault_is_taken(tmp_path, denoised, pos, face):
    mesh = trimesh.Trimesh(pos.numpy(), face.t().numpy(), process=False)
    write_mesh(mesh, pos, tmp_path / "noisy.ply")
    pictures = ["--picture", tmp_path / "out.png", "--report", tmp_path / "out.html"]
    before, after = denoised(tmp_path / "noisy.ply", *pictures)
    assert torch.equal(before.face, face)
    assert torch.equal(after.face, face)
    assert after.pos.isfinite().all()
    referenced = torch.zeros(len(pos), dtype=torch.bool)
    referenced[face] = True
    assert torch.equal(after.pos[~referenced], before.pos[~referenced])
    _, copies = torch.unique(before.pos, dim=0, return_inverse=True)
    for number in range(int(copies.max()) + 1):
        assert (after.pos[referenced & (copies == number)].unique(dim=0)).size(0) <= 1  # no crack
    if pos.unique(dim=0).size(0) == 1:
        assert torch.equal(after.pos, before.pos)


def test_boundary_stays_in_place(tmp_path, denoised):
    write_mesh(trimesh.Trimesh(POS.numpy(), FACE.t().numpy(), process=False), POS, tmp_path / "noisy.ply")
    before, after = denoised(tmp_path / "noisy.ply", "--preserve_boundary")
    inside = ((POS[:, :2] > 0) & (POS[:, :2] < 4)).all(dim=1)
    assert torch.equal(after.pos[~inside], before.pos[~inside])
    assert (after.pos[inside] != before.pos[inside]).any()


@pytest.mark.parametrize("ending", [".obj", ".ply", ".off"])
def test_polygons_stay_polygons(tmp_path, denoised, ending):
    polygons = [[0, 1, 6, 5], [1, 2, 3, 8, 7], [1, 7, 6], [5, 6, 11, 10]]
    points = [" ".join(map(str, point)) for point in POS.tolist()]
    counted = [f"{len(corners)} {' '.join(map(str, corners))}" for corners in polygons]
    lines = {
        ".obj": [f"v {point}" for point in points] + [f"f {' '.join(str(c + 1) for c in row)}" for row in polygons],
        ".ply": ["ply", "format ascii 1.0", "element vertex 25", *(f"property double {axis}" for axis in "xyz"),
                 "element face 4", "property list uchar int vertex_indices", "end_header", *points, *counted],
        ".off": ["OFF", "25 4 0", *points, *counted],
    }[ending]  # fmt: skip
    source = tmp_path / f"noisy{ending}"
    source.write_text("\n".join(lines) + "\n")
    before, after = denoised(source)
    assert before.face.size(1) == 8
    assert not torch.equal(before.pos, after.pos)
    written = (tmp_path / f"out{ending}").read_text().splitlines()
    assert written[-4:] == lines[-4:]
