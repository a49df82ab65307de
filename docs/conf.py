"""How Sphinx builds the documentation: `make docs`."""

import inspect
import logging
import os
import shutil
import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util.inspect import stringify_signature

import dnf_pyg

DOCS = Path(__file__).parent
os.environ.setdefault("OMP_NUM_THREADS", "1")  # for the notebooks, which are tiny
sys.path.insert(0, str(DOCS / "_ext"))
logging.getLogger("traitlets").setLevel(logging.ERROR)  # one line for each notebook that runs
shutil.copytree(DOCS.parent / "notebooks", DOCS / "notebooks", dirs_exist_ok=True)  # Sphinx reads below docs/ only

project = "dnf_pyg"
author = "The dnf_pyg authors"
project_copyright = f"{author}, MIT licence"
version = release = dnf_pyg.__version__

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "myst_nb", "mathml"]
exclude_patterns = ["_ext", "examples", "pictures", "notebooks/conftest.py"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
suppress_warnings = ["mystnb.unknown_mime_type"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS.parent / "site" / ".notebooks")
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_excludepatterns = ["*.md"]
nb_output_stderr = "remove"  # notes of libraries about the machine at hand
nb_merge_streams = True

napoleon_numpy_docstring = False
napoleon_custom_sections = ["Shapes"]
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
python_maximum_signature_line_length = 90
python_use_unqualified_type_names = True
nitpicky = True  # a role that names something of ours has to find it
nitpick_ignore_regex = [(r"py:.*", r"(?!dnf_pyg\.|datamodules\.).*"), (r"py:mod", r".*")]

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "dnf_pyg"
html_static_path = ["_static"]
html_css_files = ["dnf_pyg.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#2563c9", "color-brand-content": "#2563c9"},
    "dark_css_variables": {"color-brand-primary": "#6ea4ff", "color-brand-content": "#6ea4ff"},
}


def _link_copied_notebooks(app: Sphinx, docname: str, source: list[str]) -> None:
    source[0] = source[0].replace("](../notebooks/", "](notebooks/")


def _skip_fields_of_tuples(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what a NamedTuple says of its fields: the class describes them."""
    return True if type(obj).__name__ == "_tuplegetter" else None


def _own_paragraphs(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Set sources and departures from them apart from the text before."""
    for row in range(len(lines) - 1, 0, -1):
        if lines[row].startswith(("Source:", "Differs:")) and lines[row - 1].strip():
            lines.insert(row, "")


def _signature_of_init(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Show the arguments of ``__init__`` where a mixin's ``__new__`` hides them."""
    if what == "class" and signature == "(*args, **kwargs)":
        signature = stringify_signature(inspect.signature(obj.__init__), unqualified_typehints=True)
        signature = signature.removesuffix(" -> None").replace("(self, ", "(", 1)
    return signature, returned


def setup(app: Sphinx) -> None:
    """Connect the hooks."""
    app.connect("autodoc-process-docstring", _own_paragraphs)
    app.connect("autodoc-process-signature", _signature_of_init)
    app.connect("source-read", _link_copied_notebooks)
    app.connect("autodoc-skip-member", _skip_fields_of_tuples)
