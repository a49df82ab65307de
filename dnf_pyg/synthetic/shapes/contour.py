"""Triangles on the boundary of a solid, with vertices exactly on its sharp edges and corners."""

from itertools import permutations
from typing import NamedTuple

import torch
from torch import Tensor

from dnf_pyg.synthetic.shapes.solid import Solid

__all__ = ["LabelledMesh", "contour", "project"]


_BLOCK = 4  # grid points along an edge of a block that is classified at once


class LabelledMesh(NamedTuple):
    """A mesh whose faces are labelled with the surfaces they lie on.

    Shapes:
        - **pos:** :math:`(V, 3)` float64
        - **face:** :math:`(3, F)` long
        - **label:** :math:`(F)` long, row in ``Solid.surfaces``
    """

    pos: Tensor
    face: Tensor
    label: Tensor


def contour(solid: Solid, low: Tensor, high: Tensor, spacing: float) -> LabelledMesh:
    """Mesh the boundary of a solid by marching tetrahedra whose triangles are cut along sharp edges.

    Each crossing of a grid edge lies on one surface. A triangle with crossings on two or three surfaces is cut where
    they meet: edge and corner points come from Newton steps onto all of the surfaces. So every face lies on one
    surface, and the mesh is manifold and closed where the solid is.
    Source: Kobbelt et al. 2001, "Feature sensitive surface extraction from volume data", for the inserted points.

    Args:
        solid: Solid to mesh.
        low: Lower corner (3) of a box that holds the solid with a margin.
        high: Upper corner (3).
        spacing: Edge length of the grid's cells, model units; smaller than the solid's smallest feature.

    Returns:
        A mesh with triangles of very different sizes, for :func:`remesh`.
    """
    blocks = ((high - low) / (_BLOCK * spacing)).ceil().long() + 1
    grid = low + spacing * _lattice(_BLOCK * blocks)
    inside = _classify(solid, grid.view(*(_BLOCK * blocks).tolist(), 3))
    grid, size = grid.view(-1, 3), _BLOCK * blocks
    triangle = _march(inside, size)  # (T, 3, 2) grid points at both ends of each corner's grid edge, inner first
    key, face = (triangle.view(-1, 2) @ torch.tensor([len(grid), 1])).unique(return_inverse=True)
    pos, label = _bisect(solid, grid[key // len(grid)], grid[key % len(grid)])
    return _cut(solid, pos, label, face.view(-1, 3))


def project(solid: Solid, pos: Tensor, vertex: Tensor, label: Tensor, num_steps: int = 6) -> Tensor:
    """Move vertices by Newton steps onto all the surfaces they are paired with.

    Args:
        solid: Solid whose surfaces are meant.
        pos: Positions (V, 3).
        vertex: Vertex of each pair (vertex, surface); repeated pairs count once.
        label: Surface of each pair.
        num_steps: Newton steps.
    """
    if not vertex.numel():
        return pos
    num_labels = len(solid.surfaces)
    vertex, label = (
        torch.div(pair := (vertex * num_labels + label).unique(), num_labels, rounding_mode="floor"),
        pair % num_labels,
    )
    degree = vertex.bincount(minlength=pos.size(0))
    slot = torch.arange(vertex.numel()) - (degree.cumsum(0) - degree)[vertex]
    groups = [(int(surface), (label == surface).nonzero()[:, 0]) for surface in label.unique()]
    several = (degree > 1).nonzero()[:, 0]
    pos = pos.clone()
    for _ in range(num_steps):
        value = pos.new_zeros(pos.size(0), int(degree.max()))
        slope = pos.new_zeros(*value.shape, 3)
        for surface, rows in groups:
            value[vertex[rows], slot[rows]], slope[vertex[rows], slot[rows]] = solid.surfaces[surface].slope(
                pos[vertex[rows]]
            )
        step = -value[:, :1] * slope[:, 0] / slope[:, 0].square().sum(1, keepdim=True).clamp(min=1e-12)
        step[several] = -(torch.linalg.pinv(slope[several], rtol=0.05) @ value[several][..., None])[..., 0]
        pos += step
    return pos


def _lattice(size: Tensor) -> Tensor:
    """Whole-number coordinates (X * Y * Z, 3) of a grid."""
    axes = [torch.arange(int(n), dtype=torch.float64) for n in size]
    return torch.stack(torch.meshgrid(*axes, indexing="ij"), -1).view(-1, 3)


def _classify(solid: Solid, grid: Tensor) -> Tensor:
    """Whether each grid point is inside; far from the boundary one point decides for a block of 64."""
    middle = grid[_BLOCK // 2 :: _BLOCK, _BLOCK // 2 :: _BLOCK, _BLOCK // 2 :: _BLOCK]
    value = solid.evaluate(middle.reshape(-1, 3))[0].view(middle.shape[:3])
    block = float((middle[1, 0, 0] - middle[0, 0, 0]).norm())
    slope = max(1.0, *(float(value.diff(dim=axis).abs().max()) / block for axis in range(3)))
    near = value.abs() < 1.2 * slope * block
    inside, close = (
        x.repeat_interleave(_BLOCK, 0).repeat_interleave(_BLOCK, 1).repeat_interleave(_BLOCK, 2)
        for x in (value < 0, near)
    )
    points = grid[close]
    inside[close] = torch.cat([solid.evaluate(chunk)[0] < 0 for chunk in points.split(65536)])
    return inside.reshape(-1)


def _march(inside: Tensor, size: Tensor) -> Tensor:
    """Triangles (T, 3, 2) of marching tetrahedra, six around the diagonal of each cell."""
    stride = [int(size[1] * size[2]), int(size[2]), 1]
    cell = torch.arange(inside.numel()).view(*size.tolist())[:-1, :-1, :-1].reshape(-1)
    mixed = torch.zeros(cell.numel(), dtype=torch.bool)
    for shift in range(1, 8):
        corner = cell + sum(stride[axis] for axis in range(3) if shift >> axis & 1)
        mixed |= inside[corner] != inside[cell]
    cell = cell[mixed]
    found = []
    for order in permutations(range(3)):
        tet = torch.stack([cell + sum(stride[axis] for axis in order[:n]) for n in range(4)], 1)  # (C, 4)
        if order in ((1, 0, 2), (0, 2, 1), (2, 1, 0)):  # odd: mirrored
            tet = tet[:, [1, 0, 2, 3]]
        code = (inside[tet].long() * torch.tensor([1, 2, 4, 8])).sum(1)
        for case, triangles in _CASES.items():
            rows = tet[code == case]
            found += [rows[:, corners] for corners in triangles]  # (R, 3, 2)
    return torch.cat(found)


def _cases() -> dict[int, list[list[tuple[int, int]]]]:
    """Triangles of a tetrahedron by the bit mask of its inner corners; each corner (inner, outer)."""
    cases: dict[int, list[list[tuple[int, int]]]] = {}
    for a, b, c, d in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 0, 1, 3), (3, 0, 2, 1)):  # even permutations
        cases[1 << a] = [[(a, b), (a, c), (a, d)]]
        cases[15 - (1 << a)] = [[(b, a), (d, a), (c, a)]]
    for a, b, c, d in ((0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (2, 3, 0, 1), (3, 1, 0, 2), (1, 2, 0, 3)):
        cases[1 << a | 1 << b] = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    return cases


_CASES = _cases()


def _bisect(solid: Solid, inner: Tensor, outer: Tensor) -> tuple[Tensor, Tensor]:
    """Points (Q, 3) and labels (Q) where the boundary crosses the segments from ``inner`` to ``outer``."""
    for _ in range(24):
        middle = (inner + outer) / 2
        value, label = solid.evaluate(middle)
        inner, outer = (
            torch.where((value < 0)[:, None], middle, inner),
            torch.where((value < 0)[:, None], outer, middle),
        )
    return middle, label


def _cut(solid: Solid, pos: Tensor, label: Tensor, face: Tensor) -> LabelledMesh:
    """Cut the triangles (T, 3) whose corners lie on different surfaces."""
    side = torch.stack([face, face.roll(-1, 1)], -1)  # (T, 3, 2)
    mixed = label[side[..., 0]] != label[side[..., 1]]  # (T, 3)
    edge, row = side[mixed].sort(-1).values.unique(dim=0, return_inverse=True)
    split = torch.full(mixed.shape, -1)
    split[mixed] = pos.size(0) + row
    joint = project(solid, pos[edge].mean(1), torch.arange(edge.size(0)).repeat_interleave(2), label[edge].view(-1))
    corner = face[mixed.all(1)]
    core = project(
        solid, pos[corner].mean(1), torch.arange(corner.size(0)).repeat_interleave(3), label[corner].view(-1)
    )
    triangles, labels = [face[~mixed.any(1)]], [label[face[~mixed.any(1), 0]]]
    for turn in range(3):  # two surfaces: the corner alone on its surface comes first
        turned, cut = face.roll(-turn, 1), split.roll(-turn, 1)
        rows = (cut[:, 0] >= 0) & (cut[:, 2] >= 0) & (cut[:, 1] < 0)
        a, b, c = turned[rows].unbind(1)
        first, last = cut[rows, 0], cut[rows, 2]
        triangles += [torch.stack(t, 1) for t in ((a, first, last), (first, b, c), (first, c, last))]
        labels += [label[a], label[b], label[b]]
    middle = pos.size(0) + edge.size(0) + torch.arange(corner.size(0))
    for turn in range(3):  # three surfaces meet in the middle
        a = face.roll(-turn, 1)[mixed.all(1), 0]
        first, last = split.roll(-turn, 1)[mixed.all(1)][:, [0, 2]].unbind(1)
        triangles += [torch.stack([a, first, middle], 1), torch.stack([a, middle, last], 1)]
        labels += [label[a], label[a]]
    return LabelledMesh(torch.cat([pos, joint, core]), torch.cat(triangles).t().contiguous(), torch.cat(labels))
