"""Draw how data flow: `python docs/pictures/architecture.py` writes docs/images/architecture.svg."""

from html import escape
from pathlib import Path

TARGET = Path(__file__).parents[1] / "images" / "architecture.svg"
WIDTH, HEIGHT, BOX, TALL = 1010, 605, 148, 62
COLUMNS = [22, 187, 352, 517, 682, 847]

# Title of a lane, its top, and its boxes: column, step, module that implements it
LANES = [
    ("Denoise", 34, [
        (0, "read the file", "dnf_pyg.io.files"),
        (1, "weld copies of vertices, estimate the noise level", "dnf_pyg.pipeline"),
        (2, "cover the mesh with patches", "dnf_pyg.patches.coverage"),
        (3, "filter the normals of each patch", "dnf_pyg.nn.network"),
        (4, "average the normals of overlapping patches", "dnf_pyg.patches.fusion"),
        (5, "move vertices to fit the normals", "dnf_pyg.mesh.vertex_update"),
    ]),
    ("Network (SurfaceDNFNet): a batch of patches", 188, [
        (0, "turn each patch into its own frame", "dnf_pyg.nn.frame"),
        (1, "group the nearest faces on levels k₁ < k₂ < k₃", "dnf_pyg.nn.grouping"),
        (2, "scale channels by the whole patch", "dnf_pyg.nn.attention"),
        (3, "combine the features of all levels", "dnf_pyg.nn.surface_embedding"),
        (4, "subtract the residual found in similar faces", "dnf_pyg.nn.residual"),
        (5, "predict normals, apply the bilateral filter", "dnf_pyg.nn.bilateral"),
    ]),
    ("Train", 342, [
        (0, "clean meshes with added noise, or pairs", "dnf_pyg.mesh.noise"),
        (1, "cut patches once, map them into memory", "dnf_pyg.datasets.cache"),
        (2, "augment and batch the patches", "dnf_pyg.datamodules.patches"),
        (3, "training steps, logging, optimizer", "dnf_pyg.train.module"),
        (4, "loss of the normals and the residuals", "dnf_pyg.train.losses"),
        (5, "checkpoint → network", "dnf_pyg.weights.load"),
    ]),
    ("Measure and show", 496, [
        (0, "find the test meshes", "dnf_pyg.datasets.pairing"),
        (1, "classical filters", "dnf_pyg.evaluate.baselines"),
        (2, "θ and E_v", "dnf_pyg.evaluate.metrics"),
        (3, "tables and plots of a test set", "dnf_pyg.evaluate.benchmark"),
        (4, "pictures and the 3D page", "dnf_pyg.view"),
        (5, "release weights with a model card", "dnf_pyg.weights.release"),
    ]),
]  # fmt: skip


def lines_of(text: str, width: int = 19) -> list[str]:
    """Wrap a text."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) + 1 > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def box(column: int, top: int, text: str, module: str) -> str:
    """Draw a box with a step and, below it, the module that implements it."""
    x = COLUMNS[column]
    parts = [f'<rect x="{x}" y="{top}" width="{BOX}" height="{TALL + 24}" rx="8"/>']
    for row, line in enumerate(lines_of(text)):
        parts.append(f'<text x="{x + BOX / 2}" y="{top + 21 + 16 * row}">{escape(line)}</text>')
    name = module.removeprefix("dnf_pyg.")
    parts.append(f'<text class="code" x="{x + BOX / 2}" y="{top + TALL + 13}">{escape(name)}</text>')
    return "".join(parts)


def drawing() -> str:
    """Draw the whole picture."""
    parts = []
    for title, top, boxes in LANES:
        parts.append(f'<text class="title" x="22" y="{top - 10}">{escape(title)}</text>')
        parts += [box(column, top, text, module) for column, text, module in boxes]
        if title != "Measure and show":
            y = top + 43
            parts += [f'<path d="M{COLUMNS[i] + BOX} {y}h13"/>' for i in range(5)]
    middle = COLUMNS[3] + BOX / 2
    parts.append(f'<path d="M{middle} 120V152H8V231H18"/>')  # from the network box to its lane
    parts.append(f'<path class="soft" d="M{COLUMNS[5] + BOX / 2} 342V306H{middle}V279"/>')
    parts.append(f'<text class="note" x="{middle + 120}" y="300">trained weights</text>')
    parts.append(f'<text class="note" x="{middle - 150}" y="145">normals, centroids, areas and edges</text>')
    style = (
        "text{font:13px system-ui,sans-serif;fill:#1c2430;text-anchor:middle}"
        "rect{fill:#f2f6fc;stroke:#9db7dd}path{fill:none;stroke:#2563c9;stroke-width:1.6;marker-end:url(#tip)}"
        ".soft{stroke-dasharray:5 4}.code{font:11px ui-monospace,monospace;fill:#2563c9}"
        ".title{font-weight:600;text-anchor:start}.note{font-size:12px;fill:#5d6877}"
    )
    tip = '<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
    tip += '<path d="M0 0L8 4L0 8z" style="fill:#2563c9;stroke:none"/></marker>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        f"<title>How data flow through dnf_pyg</title><style>{style}</style><defs>{tip}</defs>"
        f'<rect width="{WIDTH}" height="{HEIGHT}" style="fill:#fff;stroke:none"/>{"".join(parts)}</svg>\n'
    )


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8")
