import runpy
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "point_cloud_classifier.py"


def test_learns_to_tell_shapes_apart():
    assert runpy.run_path(str(EXAMPLE))["main"]() > 0.9
