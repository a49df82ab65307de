"""The picture of the architecture names modules that exist, and is the one that its script draws."""

import re
import runpy
from importlib.util import find_spec
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_every_module_exists():
    script = runpy.run_path(str(DOCS / "pictures" / "architecture.py"))
    for _, _, boxes in script["LANES"]:
        for _, _, module in boxes:
            assert find_spec(module), module
    assert (DOCS / "images" / "architecture.svg").read_text(encoding="utf-8") == script["drawing"]()


def test_text_stays_in_its_box():
    drawn = (DOCS / "images" / "architecture.svg").read_text(encoding="utf-8")
    assert max(map(len, re.findall(r"<text x=[^>]*>([^<]*)<", drawn))) <= 22
