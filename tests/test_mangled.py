"""Meshes that are mangled at random: `denoise` raises no error but its own, and keeps its promises."""

import warnings

import numpy as np
import pytest
import torch
import trimesh

from dnf_pyg import DenoiseWarning, DNFError, UpdateOptions, denoise
from dnf_pyg.mesh import mean_edge_length
from dnf_pyg.mesh.weld import weld
from dnf_pyg.weights.load import load_cascade

SHAPES = (
    trimesh.creation.icosphere(subdivisions=2),
    trimesh.creation.torus(10, 3, 16, 12),
    trimesh.creation.box((4, 2, 1)).subdivide().subdivide(),
    trimesh.creation.cylinder(5, 100, sections=32),
    trimesh.creation.annulus(3, 5, 2, sections=48),
)
BESIDE = trimesh.creation.box()  # a clean part of 12 faces, far from the rest


@pytest.fixture(scope="module")
def best():
    return load_cascade("best")


def dropped(pos, face, draw):
    return pos, face[draw.random(len(face)) > draw.choice([0.02, 0.3, 0.9])]


def torn(pos, face, draw):
    """A hole: all faces around a few vertices are gone."""
    return pos, face[~np.isin(face, draw.integers(len(pos), size=4)).any(axis=1)]


def repeated(pos, face, draw):
    return pos, np.concatenate([face, face[draw.integers(len(face), size=len(face) // 4)]])


def flipped(pos, face, draw):
    turned = draw.random(len(face)) < draw.choice([0.02, 0.5])
    return pos, np.where(turned[:, None], face[:, ::-1], face)


def degenerate(pos, face, draw):
    face = face.copy()
    rows = draw.integers(len(face), size=len(face) // 10)
    face[rows, 0] = face[rows, 1]
    return pos, face


def merged(pos, face, draw):
    """Vertices at one point, so faces are needles or points."""
    pos = pos.copy()
    pos[draw.integers(len(pos), size=len(pos) // 8)] = pos[draw.integers(len(pos))]
    return pos, face


def fanned(pos, face, draw):
    """Faces between vertices from anywhere: edges of many faces, vertices of several sheets, long triangles."""
    extra = draw.integers(len(pos), size=(20, 3))
    extra[:10, :2] = face[0, :2]
    return pos, np.concatenate([face, extra])


def spiked(pos, face, draw):
    pos = pos.copy()
    rows = draw.integers(len(pos), size=3)
    pos[rows] *= draw.choice([-1.0, 3.0, 1e4], size=(3, 1))
    return pos, face


def scaled(pos, face, draw):
    return pos * draw.choice([1e-90, 1e-12, 1e6, 1e27]), face


def squashed(pos, face, draw):
    return pos * draw.choice([0.0, 1e-9, 1.0, 1e6], size=3), face


def shifted(pos, face, draw):
    return pos + draw.choice([-1.0, 1.0], size=3) * np.ptp(pos) * 1e6, face


def crumbled(pos, face, draw):
    """Every face by itself, with corners of its own."""
    return pos[face.ravel()] + draw.choice([0, 0.3]) * draw.standard_normal((face.size, 3)), np.arange(
        face.size
    ).reshape(-1, 3)


def rounded(pos, face, draw):
    step = np.ptp(pos) / draw.choice([4, 64, 1000]) or 1.0
    return np.round(pos / step) * step, face


def lost(pos, face, draw):
    """NaN, infinity or a number that is too large, in a vertex that faces may use or not."""
    pos = pos.copy()
    pos[draw.integers(len(pos)), draw.integers(3)] = draw.choice([np.nan, np.inf, 1e300])
    return pos, face[len(face) // 2 :]


CHANGES = (
    dropped, torn, repeated, flipped, degenerate, merged, fanned, spiked,
    scaled, squashed, shifted, crumbled, rounded, lost,
)  # fmt: skip


def mangled(seed):
    """Positions (V, 3) and faces (F, 3) after noise and one to three changes, and the names of these."""
    draw = np.random.default_rng(seed)
    mesh = SHAPES[draw.integers(len(SHAPES))]
    pos, face = np.array(mesh.vertices), np.array(mesh.faces)
    pos += draw.choice([0.0, 0.02, 0.2]) * np.median(mesh.edges_unique_length) * draw.standard_normal(pos.shape)
    beside = BESIDE.vertices * np.ptp(pos) / 20 + 2 * np.ptp(pos)
    changes = [CHANGES[number] for number in draw.choice(len(CHANGES), size=draw.integers(1, 4), replace=False)]
    for change in changes:
        pos, face = change(pos, face, draw)
        if len(face) == 0:
            break
    if not {scaled, squashed, shifted, lost} & set(changes):
        pos, face = np.concatenate([pos, beside]), np.concatenate([face, BESIDE.faces + len(pos)])
    return pos, face, [change.__name__ for change in changes]


@pytest.mark.parametrize("seed", range(24))
def test_keeps_its_promises(seed, best):
    pos, face, changes = mangled(seed)
    max_move = 0.5 if seed % 2 else 1e9
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", DenoiseWarning)
        try:
            result = denoise((pos, face), best, update=UpdateOptions(max_move=max_move))
        except DNFError as error:
            refusal = str(error)
        else:
            refusal = ""
    if refusal:
        assert refusal.startswith("Expected ")
        assert len(face) == 0 or {"lost", "scaled", "squashed"} & set(changes)
        return
    used = np.isin(np.arange(len(pos)), face)
    moved = result.vertices - pos
    assert np.isfinite(result.vertices[used]).all()
    assert np.isfinite(result.normal.numpy()).all()
    alone = ~used & ~np.isin(pos, pos[used]).all(axis=1)  # no copy of a vertex that moves
    assert np.array_equal(result.vertices[alone], pos[alone], equal_nan=True)
    assert np.array_equal(result.face.numpy().T, face)
    points, corner, _ = weld(torch.tensor(pos), torch.tensor(face.copy()).t())
    unit = float(mean_edge_length(points, corner))
    assert np.linalg.norm(moved[used], axis=1).max() <= max_move * unit * (1 + 1e-6) + 1e-9 * np.abs(pos[used]).max()
    if np.array_equal(face[-12:], BESIDE.faces + len(pos) - 8):
        assert (moved[-8:] == 0).all()
    _, place = np.unique(pos[used], axis=0, return_inverse=True)
    together = np.zeros((place.max() + 1, 3))
    together[place] = result.vertices[used]
    assert np.array_equal(together[place], result.vertices[used])  # copies of a vertex stay together
