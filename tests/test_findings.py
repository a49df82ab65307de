import re

import pytest

from dnf_pyg.findings import findings


@pytest.mark.parametrize(
    ("level", "known", "other", "text"),
    [
        (0.01, (0.03, 0.45), {}, "below 0.03"),
        (0.6, (0.03, 0.45), {}, r"above 0.45, .* Use two passes"),
        (0.2, (0.03, 0.45), {"left_alone": 0.31}, "31% of the mesh stays as it is"),
        (0.0, (0.03, 0.45), {"left_alone": 1.0}, "100% of the mesh stays as it is"),
        (0.2, None, {"num_turned": 1200}, "wound the other way than their neighbours: 1,200"),
        (0.2, None, {"num_doubled": 7}, "lie on another of the same vertices.*: 7"),
        (0.2, None, {"num_flipped": 3}, "remain flipped because the input is folded there: 3"),
    ],
)
def test_each_finding_is_told_once(level, known, other, text):
    (found,) = findings(level, known, **other)
    assert re.search(text, found)


def test_nothing_to_tell():
    assert findings(0.2, (0.03, 0.45), left_alone=0.001) == []
    assert findings(5.0, None) == []
