"""Figures that the pages quote are those that came with the weights."""

import csv
import json
from pathlib import Path

import pytest

from dnf_pyg import packaged_weights

ROOT = Path(__file__).resolve().parents[2]


def measured(name):
    return json.loads((packaged_weights()[name] / "metrics.json").read_text())["benchmark"]


def test_readme_quotes_the_packaged_weights():
    row = next(line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("| **dnf_pyg** |"))
    quoted = [float(cell.strip(" *")) for cell in row.split("|")[2:-1]]
    best = measured("best")
    expected = [best["theta_deg"], *(best["theta_by_mesh"][mesh] for mesh in ("block", "cube", "sphere"))]
    assert quoted == [pytest.approx(value, abs=0.006) for value in expected]


@pytest.mark.parametrize("name", ["best", "single", "small", "synthetic"])
def test_committed_table_is_of_the_packaged_weights(name):
    with (ROOT / "docs" / "results" / "results.csv").open() as stream:
        rows = [float(row["theta_deg"]) for row in csv.DictReader(stream) if row["method"] == name]
    assert len(rows) == 36
    assert sum(rows) / 36 == pytest.approx(measured(name)["theta_deg"], abs=1e-4)
