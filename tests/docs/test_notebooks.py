"""Notebooks are stored with small outputs of their present code and weights; pytest runs them by nbmake."""

import runpy
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SCRIPT = runpy.run_path(str(ROOT / "docs" / "pictures" / "notebooks.py"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_current_and_small(path):
    notebook = nbformat.read(path, 4)
    nbformat.validate(notebook)
    assert notebook.metadata.outputs_of == SCRIPT["digest"](notebook), "run docs/pictures/notebooks.py"
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == [*range(1, len(cells) + 1)]
    outputs = [output for cell in cells for output in cell.outputs]
    assert sum(any(kind.startswith("image/") for kind in output.get("data", {})) for output in outputs) >= 2
    assert not any(output.output_type == "error" or output.get("name") == "stderr" for output in outputs)
    assert path.stat().st_size < 600_000


def test_digest_follows_code_and_weights():
    digest = SCRIPT["digest"]
    cells = [nbformat.v4.new_code_cell('load_network("single")'), nbformat.v4.new_markdown_cell("text")]
    notebook = nbformat.v4.new_notebook(cells=cells)
    before = digest(notebook)
    cells[1].source = "other text"
    assert digest(notebook) == before
    cells[0].source = 'load_network("best-not")'
    without = digest(notebook)
    cells[0].source = 'load_network("synthetic")'
    assert len({before, without, digest(notebook)}) == 3
