import math

import pytest
import torch
import trimesh

from dnf_pyg.mesh import adjacency, geometry
from dnf_pyg.synthetic.shapes import SHAPES, displaced
from dnf_pyg.synthetic.shapes.build import STYLES, build, even
from dnf_pyg.synthetic.shapes.contour import LabelledMesh, contour, project
from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.primitives import ball, box, cylinder, plane, rod, torus
from dnf_pyg.synthetic.shapes.solid import Intersection

LOW, HIGH = torch.full((3,), -1.5, dtype=torch.float64), torch.full((3,), 1.5, dtype=torch.float64)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def part():
    """Turned box with a round hole and a boss: planes and cylinders, edges and corners."""
    boss = rod(0.2, 0, 0.6).move(torch.eye(3, dtype=torch.float64), [0.45, 0, 0])
    solid = (box([1.6, 1.2, 0.5]) - rod(0.2, -1, 1).move(torch.eye(3, dtype=torch.float64), [-0.3, 0, 0])) | boss
    return solid.move(Dice(generator(3)).rotation())


def error_degrees(solid, mesh):
    centroid = mesh.pos[mesh.face].mean(0)
    normal = geometry.face_normals(mesh.pos, mesh.face)
    return torch.rad2deg((normal * solid.normals(centroid, mesh.label)).sum(1).clamp(-1, 1).arccos())


def test_contour_is_closed_and_lies_on_the_solid():
    solid = part()
    mesh = contour(solid, LOW, HIGH, 0.06)
    assert trimesh.Trimesh(mesh.pos, mesh.face.t(), process=False).is_watertight
    assert solid.evaluate(mesh.pos)[0].abs().max() < 1e-7
    volume = trimesh.Trimesh(mesh.pos, mesh.face.t(), process=False).volume
    assert volume == pytest.approx(1.6 * 1.2 * 0.5 + math.pi * 0.04 * (0.35 - 0.5), rel=0.01)


@pytest.mark.parametrize("style", STYLES)
def test_styles_keep_flat_sides_flat_and_edges_sharp(style):
    solid = part()
    mesh = build(solid, 5000, Dice(generator()), style)
    assert 2500 < mesh.face.size(1) < 10000
    assert trimesh.Trimesh(mesh.pos, mesh.face.t(), process=False).is_watertight
    assert solid.evaluate(mesh.pos)[0].abs().max() < 1e-6
    flat = torch.tensor([surface not in (6, 9) for surface in range(len(solid.surfaces))])[mesh.label]
    error = error_degrees(solid, mesh)
    assert error[flat].max() < 0.01  # rounding of arccos near 1
    assert (error[~flat] > 5).double().mean() < 0.2
    assert error.max() < 45


def test_even_triangles_are_even():
    mesh = build(torus(0.9, 0.35), 4000, Dice(generator()), even)
    length = (mesh.pos[mesh.face] - mesh.pos[mesh.face.roll(1, 0)]).norm(dim=2)
    assert length.std() / length.mean() < 0.2
    assert mesh.face.size(1) == pytest.approx(4000, rel=0.25)


def test_project_puts_points_on_edges_and_corners():
    corner = Intersection([plane((1, 0, 0), 1), plane((0, 1, 0), 1), plane((0, 0, 1), 1)])
    pos = torch.tensor([[0.9, 0.8, 0.7], [0.9, 0.8, 0.7]], dtype=torch.float64)
    moved = project(corner, pos, torch.tensor([0, 0, 0, 1, 1]), torch.tensor([0, 1, 2, 0, 1]))
    torch.testing.assert_close(moved, torch.tensor([[1.0, 1, 1], [1, 1, 0.7]], dtype=torch.float64))


def test_project_survives_surfaces_that_touch():
    touching = plane((0, 0, 1), 0) | cylinder(1.0).move(torch.eye(3, dtype=torch.float64)[[2, 1, 0]], [0, 0, 1.0])
    pos = torch.tensor([[0.0, 0.05, 0.02]], dtype=torch.float64)
    moved = project(touching, pos, torch.tensor([0, 0]), torch.tensor([0, 1]))
    assert (moved - pos).norm() < 0.1


def test_too_small_details_are_refused():
    assert build(box([1.5, 1.5, 0.01]), 500, Dice(generator())) is None
    assert build(ball(0.5) & plane((0, 0, 1), -1), 500, Dice(generator())) is None


def test_shapes_repeat_for_a_seed():
    (pos, face), (again, face_again) = (SHAPES["twist"](generator(1), 800) for _ in range(2))
    assert torch.equal(pos, again)
    assert torch.equal(face, face_again)


@pytest.mark.parametrize(
    "name", ["blob", "bracket", "coarse", "knot", "lens", "limbs", "nut", "relief", "simple", "thin"]
)
def test_shapes_are_valid(name):
    pos, face = SHAPES[name](generator(1), 1200)
    assert 500 < face.size(1) < 4000
    assert torch.isfinite(pos).all()
    assert face.unique().numel() == pos.size(0)
    mesh = trimesh.Trimesh(pos, face.t(), process=False)
    assert mesh.is_winding_consistent
    assert adjacency.boundary_vertices(face, pos.size(0)).any() or (mesh.is_watertight and mesh.volume > 0)
    assert geometry.face_areas(pos, face).min() > 0


def test_relief_has_waves_of_3_to_12_edges_everywhere(monkeypatch):
    """On a sphere, with edges of all directions, a wave of w edges correlates neighbours by sin(k) / k, k = 2 pi / w.

    Slopes of 0.1 to 0.5 make the height of waves of 3 to 9 edges, before they are stretched by up to a third.
    """
    ball = trimesh.creation.icosphere(subdivisions=4)
    pos, face = torch.tensor(ball.vertices), torch.tensor(ball.faces).t()
    monkeypatch.setattr(displaced, "build_recipe", lambda *_: LabelledMesh(pos, face, torch.zeros(face.size(1))))
    octant = ((pos > 0).long() @ torch.tensor([4, 2, 1]))[None] == torch.arange(8)[:, None]
    one, other = geometry.edges(face)
    lowest, highest = (math.sin(2 * math.pi / wave) / (2 * math.pi / wave) for wave in (3, 12))
    for seed in range(20):
        height = ((SHAPES["relief"](generator(seed), 5120)[0] - pos) * pos).sum(dim=1) / geometry.mean_edge_length(
            pos, face
        )
        spread = height.std()
        assert 0.9 * 0.1 * 3 < 2 * math.pi * spread < 1.1 * 0.5 * 9
        assert min(height[part].std() for part in octant) > 0.5 * spread
        correlation = 1 - (height[one] - height[other]).square().mean() / (2 * height.var())
        assert lowest - 0.02 < correlation < highest + 0.02
