import torch

from dnf_pyg.synthetic.shapes.dice import Dice


def test_rotations_are_rotations():
    dice = Dice(torch.Generator().manual_seed(0))
    for _ in range(20):
        turn = dice.rotation()
        torch.testing.assert_close(turn @ turn.t(), torch.eye(3, dtype=torch.float64))
        assert float(torch.linalg.det(turn)) > 0


def test_rotations_take_an_axis_everywhere_alike():
    dice = Dice(torch.Generator().manual_seed(0))
    axis = torch.stack([dice.rotation()[:, 0] for _ in range(2000)])
    assert axis.mean(dim=0).abs().max() < 0.05
    torch.testing.assert_close(axis.t() @ axis / 2000, torch.eye(3, dtype=torch.float64) / 3, atol=0.03, rtol=0)


def test_the_same_generator_gives_the_same():
    def values(seed):
        dice = Dice(torch.Generator().manual_seed(seed))
        return [dice.uniform(0, 1), dice.integer(0, 99), dice.choice("abcdefgh"), dice.chance(0.5), *dice.direction()]

    assert values(3) == values(3)
    assert values(3) != values(4)


def test_dice_with_the_same_places_return_once_to_what_is_kept():
    places = {}
    dice = Dice(torch.Generator().manual_seed(0), places)
    skipped = dice.uniform(0, 1)
    place = dice.mark("here")
    kept = [dice.uniform(0, 1), dice.uniform(0, 1)]
    dice.keep("here", place)
    other = Dice(torch.Generator().manual_seed(5), places)
    assert other.uniform(0, 1) != skipped
    other.mark("here")
    assert [other.uniform(0, 1), other.uniform(0, 1)] == kept
    following = other.mark("here")  # nothing is kept any more
    assert torch.equal(following, other.generator.get_state())
