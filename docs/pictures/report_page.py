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
    """Open a page coloured by error, and keep what is seen."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    flags = [
        "--headless=new",
        "--no-sandbox",
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
    ]
    flags += ["--hide-scrollbars", "--virtual-time-budget=5000", f"--window-size={SIZE}", f"--screenshot={picture}"]
    subprocess.run([str(chromium), *flags, f"{page.as_uri()}#error"], check=True, capture_output=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        clean, noisy, output, page = (str(folder / name) for name in ("clean.ply", "gear.ply", "out.ply", "page.html"))
        main(["make-shape", "gear", "-o", clean, "--faces", "12000", "--seed", "1001"])  # training has not seen it
        main(["add-noise", clean, "-o", noisy, "--level", "0.2"])
        main(["denoise", noisy, "-o", output, "--reference", clean, "--report", page])
        shoot(Path(page), folder / "page.png")
        Image.open(folder / "page.png").convert("RGB").save(TARGET, quality=82, optimize=True)
