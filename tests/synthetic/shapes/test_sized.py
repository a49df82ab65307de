import pytest
import torch
from torch import Generator

from dnf_pyg.synthetic.shapes import SHAPES
from dnf_pyg.synthetic.shapes.sized import sized_shape


def counted(number_for, asked):
    """A shape with ``number_for(n)`` faces; keeps what was asked."""

    def shape(generator: Generator, num_faces: int):
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
