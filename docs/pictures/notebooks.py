"""Run the notebooks and store their outputs in them, small: `notebooks.py [NAME ...]`, all by default.

Progress bars and embedded pages are left out. A notebook that warns is not stored.
"""

import base64
import hashlib
import io
import os
import re
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "notebooks"
WEIGHTS = ROOT / "dnf_pyg" / "weights"


def digest(notebook):
    """Digest of all that outputs come from, as far as it is written down: the code and the packaged weights in it."""
    code = "\n\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    names = sorted(path.parent.name for path in WEIGHTS.glob("*/model.safetensors"))
    used = [(WEIGHTS / name / "model.safetensors").read_bytes() for name in names if f'"{name}"' in code]
    return hashlib.sha256(b"".join([code.encode(), *used])).hexdigest()[:16]


def small(picture):
    """The smaller of a JPEG and a PNG without transparency, by its type, as base64."""
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
    written = {}
    for kind, options in (("png", {"optimize": True}), ("jpeg", {"quality": 80})):
        out = io.BytesIO()
        image.save(out, kind, **options)
        written[f"image/{kind}"] = base64.b64encode(out.getvalue()).decode()
    kind = min(written, key=lambda name: len(written[name]))
    return {kind: written[kind]}


def kept(output):
    """An output as it is stored, or None."""
    if output.output_type == "stream":
        if re.search(r"\w*Warning", output.text):
            raise SystemExit(f"a cell warns: {output.text}")
        return output if output.name == "stdout" else None
    if "text/html" in output.data:
        return None
    if "image/png" in output.data:
        output.data = small(output.data["image/png"])
    output.metadata = {}
    return output


def run(path):
    """Run one notebook and store it."""
    notebook = nbformat.read(path, 4)
    NotebookClient(notebook, timeout=900, record_timing=False, resources={"metadata": {"path": NOTEBOOKS}}).execute()
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = [output for output in map(kept, cell.outputs) if output is not None]
    notebook.metadata = {
        "kernelspec": notebook.metadata.kernelspec,
        "language_info": {"name": "python"},
        "outputs_of": digest(notebook),
    }
    nbformat.write(notebook, path)
    print(f"{path.name}: {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    chosen = sys.argv[1:] or [""]
    for found in sorted(NOTEBOOKS.glob("*.ipynb")):
        if any(found.name.startswith(name) for name in chosen):
            run(found)
