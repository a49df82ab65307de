"""Links between pages, pictures and files of the checkout lead somewhere."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PLACES = ("*.md", ".github/*.md", "docs/*.md", "docs/reference/*.md", "dnf_pyg/weights/*/*.md", "notebooks/*.ipynb")
PAGES = [page for place in PLACES for page in sorted(ROOT.glob(place))]
LINK = re.compile(r"\]\(([^)\s]+)\)")


def prose(page):
    """Text of a page without its code."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(
        r"```.*?```|`[^`\n]*`", lambda code: code[0] if code[0].startswith("`[") else "", text, flags=re.DOTALL
    )


def anchors(page):
    """Anchors of the headings, as the documentation and code hosts make them."""
    for title in re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        yield re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for link in LINK.findall(prose(page)):
        if re.fullmatch(r"https://[\w.-]+\.[a-z]+(/[\w./#-]*)?", link):  # elsewhere: no test may need the network
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page.name}: {link}"
        assert not anchor or anchor in anchors(target), f"{page.name}: {link}"
