"""Whatever mesh comes in: every face covered, normals finite, indices sound; or an error of ours."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from dnf_pyg.errors import DNFError
from dnf_pyg.mesh import DijkstraGrowth, HeatGrowth, nearest_faces
from dnf_pyg.patches import FaceFeatures, PatchExtractor, cover, patch_to_data

GROWTHS = pytest.mark.parametrize("growth", [DijkstraGrowth(), HeatGrowth()], ids=repr)


def grid(rows=6, columns=6):
    """Open height field of 2 * rows * columns faces."""
    x, y = torch.meshgrid(torch.arange(columns + 1.0), torch.arange(rows + 1.0), indexing="xy")
    pos = torch.stack([x, y, torch.sin(x + 2 * y)], dim=-1).reshape(-1, 3).double()
    corner = (torch.arange(rows)[:, None] * (columns + 1) + torch.arange(columns)).flatten()
    lower = torch.stack([corner, corner + 1, corner + columns + 1])
    upper = torch.stack([corner + 1, corner + columns + 2, corner + columns + 1])
    return pos, torch.cat([lower, upper], dim=1)


POS, FACE = grid()
OTHER = FACE + len(POS)
FAULTS = {
    "open boundary": (POS, FACE),
    "components of all sizes": (torch.cat([POS, POS + 50]), torch.cat([FACE, OTHER[:, :20], OTHER[:, 40:41]], dim=1)),
    "lone faces": (POS, FACE[:, [0, 20, 33]]),
    "three faces at an edge": (POS, torch.cat([FACE, torch.tensor([[0, 0], [1, 1], [30, 40]])], dim=1)),
    "bow-tie vertex": (torch.cat([POS, POS + 50]), torch.cat([FACE, torch.where(OTHER == 49, 24, OTHER)], dim=1)),
    "zero-area faces": (POS.where(torch.arange(len(POS))[:, None] != 10, POS[9]), FACE),
    "face that names a vertex twice": (POS, torch.cat([FACE, torch.tensor([[3], [3], [9]])], dim=1)),
    "face of one vertex": (POS, torch.cat([FACE, torch.tensor([[3], [3], [3]])], dim=1)),
    "duplicate faces": (POS, torch.cat([FACE, FACE[:, :30], FACE[[1, 2, 0], :9]], dim=1)),
    "duplicate vertices": (POS[FACE.t().flatten()], torch.arange(FACE.numel()).view(-1, 3).t()),
    "unreferenced vertices": (torch.cat([POS[:5] * 7, POS]), FACE + 5),
    "mixed winding": (POS, torch.cat([FACE[:, ::2], FACE[[0, 2, 1], 1::2]], dim=1)),
    "flat": (POS * torch.tensor([1.0, 1, 0]), FACE),
    "tiny": (POS * 1e-6, FACE),
    "huge": (POS * 1e6, FACE),
    "far from the origin": (POS + 1e7, FACE),
    "single precision": (POS.float(), FACE),
    "one triangle": (POS[:3], torch.tensor([[0], [1], [2]])),
}


def check(pos, face, growth, patch_size, k, min_coverage=2):
    """Cut a mesh into its patches and look at all that comes out."""
    before = pos.clone(), face.clone()
    features = FaceFeatures.from_mesh(pos, face)
    torch.testing.assert_close(features.normal.norm(dim=1), torch.ones(face.size(1), dtype=pos.dtype))
    extractor = PatchExtractor(pos, face, growth, patch_size, k)
    count = torch.zeros(face.size(1), dtype=torch.long)
    for patch in cover(extractor, min_coverage, torch.Generator().manual_seed(0)):
        count[patch.face_id] += 1
        data = patch_to_data(patch, features)
        data.validate()
        assert data.num_nodes <= patch_size
        assert len(data.face_id.unique()) == data.num_nodes
        assert torch.isfinite(data.x).all()
        assert torch.isfinite(data.distance).all()
        assert (data.distance.diff() >= 0).all()
        row = data.edge_index[1]
        assert (row.diff() >= 0).all()
        assert torch.bincount(row, minlength=data.num_nodes).max() <= k
        first = torch.searchsorted(row, torch.arange(data.num_nodes))
        assert torch.equal(data.edge_index[0, first], torch.arange(data.num_nodes))  # every face, itself first
    assert count.min() >= min_coverage
    nearest = nearest_faces(extractor.graph, k)
    assert torch.equal(nearest[:, 0].long(), torch.arange(face.size(1)))
    assert torch.equal(before[0], pos)
    assert torch.equal(before[1], face)


@GROWTHS
@pytest.mark.parametrize("mesh", FAULTS.values(), ids=FAULTS)
def test_fault(mesh, growth):
    check(*mesh, growth, patch_size=25, k=8)
    check(*mesh, growth, patch_size=800, k=50)


def test_all_vertices_in_one_point():
    check(torch.full_like(POS, 3.0), FACE, DijkstraGrowth(), patch_size=25, k=8)
    with pytest.raises(DNFError, match=r"heat method can solve \(got .*\). Use DijkstraGrowth instead"):
        PatchExtractor(torch.full_like(POS, 3.0), FACE, HeatGrowth()).extract(0)


@st.composite
def meshes(draw):
    """Random triangles over few vertices: non-manifold, degenerate, duplicate and lone faces are the rule."""
    num_vertices = draw(st.integers(1, 14))
    coordinate = st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-7, 3.0]) | st.floats(-10, 10)
    size = draw(st.sampled_from([1.0, 1e-6, 1e6, 1e-60, 1e20]))
    shift = draw(st.sampled_from([0.0, 1.0, 1e5]))
    pos = draw(st.lists(st.tuples(*[coordinate] * 3), min_size=num_vertices, max_size=num_vertices))
    corner = st.integers(0, num_vertices - 1)
    face = draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=30))
    return (torch.tensor(pos, dtype=torch.double) + shift) * size, torch.tensor(face).t().contiguous()


@settings(max_examples=150, deadline=None)
@given(mesh=meshes(), patch_size=st.integers(1, 12), k=st.integers(1, 9), min_coverage=st.integers(1, 3))
def test_any_mesh_with_dijkstra(mesh, patch_size, k, min_coverage):
    check(*mesh, DijkstraGrowth(), patch_size, k, min_coverage)


@settings(max_examples=75, deadline=None)
@given(mesh=meshes(), patch_size=st.integers(1, 12), k=st.integers(1, 9))
def test_any_mesh_with_heat(mesh, patch_size, k):
    try:
        check(*mesh, HeatGrowth(), patch_size, k)
    except DNFError as error:
        assert "Use DijkstraGrowth instead" in str(error)  # noqa: PT017 (other meshes pass)


@settings(max_examples=75, deadline=None)
@given(mesh=meshes(), value=st.sampled_from([float("nan"), float("inf"), -float("inf")]), data=st.data())
def test_any_bad_coordinate_is_refused(mesh, value, data):
    pos, face = mesh
    row = data.draw(st.integers(0, len(pos) - 1))
    pos[row, data.draw(st.integers(0, 2))] = value
    with pytest.raises(DNFError, match=rf"at vertex {row}, 1 such vertices"):
        PatchExtractor(pos, face)
