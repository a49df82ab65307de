from types import SimpleNamespace

import pytest
import torch
from torch import Generator

from dnf_pyg.errors import OptionError
from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.synthetic.shapes.build import build_recipe
from dnf_pyg.synthetic.shapes.dice import Dice
from dnf_pyg.synthetic.shapes.sized import sized_shape


def counted(number_for, asked):
    """A shape with ``number_for(n)`` faces; keeps what was asked."""

    def shape(generator: Generator, num_faces: int, places):
        asked.append((num_faces, generator.initial_seed()))
        return torch.zeros(3, 3), torch.zeros(3, number_for(num_faces), dtype=torch.long)

    return shape


def test_asks_in_proportion_until_it_fits():
    asked = []
    _, face = sized_shape(counted(lambda n: n + n // 2, asked), 7, 900)
    assert asked == [(900, 7), (600, 7)]
    assert face.size(1) == 900


def test_keeps_the_nearest_of_those_that_do_not_fit():
    asked = []
    _, face = sized_shape(counted(lambda n: 400 if n < 1000 else 1300, asked), 0, 1000, max_tries=4)
    assert len(asked) == 4
    assert face.size(1) == 1300


@pytest.mark.parametrize("name", ["blob", "bumpy"])
@pytest.mark.parametrize(("num_faces", "frequency"), [(20, 1), (1000, 7), (3000, 12)])
def test_bodies_of_waves_have_the_faces_of_a_geodesic_sphere(name, num_faces, frequency):
    pos, face = SHAPES[name](Generator().manual_seed(0), num_faces)
    assert (len(pos), face.size(1)) == (10 * frequency**2 + 2, 20 * frequency**2)


def test_the_same_solid_is_meshed_again_whatever_details_another_size_allows(monkeypatch):
    meshed = []

    class Solid:
        def __init__(self, detail):
            self.detail = detail

        def move(self, rotation):
            return self

    def build(solid, num_faces, dice):
        if solid.detail < 1 / num_faces**0.5:
            return None
        meshed.append(solid.detail)
        dice.normal(num_faces)
        return SimpleNamespace(
            face=torch.zeros(3, num_faces // 2 if num_faces == 200 else 2 * num_faces // 5, dtype=torch.long)
        )

    def shape(generator, num_faces, places):
        mesh = build_recipe(lambda dice: Solid(0.08 * dice.uniform(0, 1)), num_faces, Dice(generator, places))
        return torch.zeros(3, 3), mesh.face

    monkeypatch.setattr("dnf_pyg.synthetic.shapes.build.build", build)
    for seed in range(20):
        meshed.clear()
        _, face = sized_shape(shape, seed, 200)
        assert face.size(1) == 200
        _, second, third = meshed  # 500 faces allow details that 400 do not
        assert second == third


def test_details_too_small_for_the_number_of_faces_are_refused(monkeypatch):
    monkeypatch.setattr("dnf_pyg.synthetic.shapes.build.build", lambda *_: None)
    expected = r"enough faces for the details of the shape \(got 20, too few for 100 solids drawn\)\. Ask for more"
    for kind in ("gear", "relief"):
        with pytest.raises(OptionError, match=expected):
            sized_shape(SHAPES[kind], 0, 20)


@pytest.mark.parametrize(("name", "num_faces"), [("block", 1000), ("polyhedron", 600)])
def test_number_of_faces_is_kept_within_a_tenth(name, num_faces):
    told = []
    _, face = sized_shape(SHAPES[name], 0, num_faces, progress=lambda *at: told.append(at))
    assert abs(face.size(1) - num_faces) <= 0.1 * num_faces
    assert told == [(number, 6) for number in range(len(told))]
