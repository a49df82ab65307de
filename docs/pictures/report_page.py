"""Draw the page of ``--report``: `python docs/pictures/report_page.py` writes docs/images/report_page.jpg.

It needs Chromium (Debian: ``apt-get install chromium``).
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

from dnf_pyg.cli import main

TARGET = Path(__file__).parents[1] / "images" / "report_page.jpg"
SIZE = "1180,1290"


def shoot(page: Path, picture: Path) -> None:
    """Open a page with the divider between before and after, and keep what is seen."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    flags = [
        "--headless=new",
        "--no-sandbox",
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
    ]
    flags += ["--hide-scrollbars", "--virtual-time-budget=5000", f"--window-size={SIZE}", f"--screenshot={picture}"]
    subprocess.run([str(chromium), *flags, f"{page.as_uri()}#swipe"], check=True, capture_output=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        main(["demo", "-o", str(folder / "demo")])
        shoot(folder / "demo" / "part.html", folder / "page.png")
        Image.open(folder / "page.png").convert("RGB").save(TARGET, quality=82, optimize=True)
