"""Save a figure as a small file: what readme.py and scans.py share."""

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

IMAGES = Path(__file__).parents[1] / "images"


def save(figure: Figure, name: str) -> None:
    """Write a figure to docs/images/NAME.png, in at most 128 colours."""
    drawn = io.BytesIO()
    figure.savefig(drawn)
    Image.open(drawn).convert("RGB").quantize(128).save(IMAGES / f"{name}.png", optimize=True)
