"""How Sphinx builds the documentation: `make docs`."""

import os
import sys
from pathlib import Path

import dnf_pyg

os.environ.setdefault("OMP_NUM_THREADS", "1")  # for the notebooks, which are tiny
sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "dnf_pyg"
author = "The dnf_pyg authors"
version = release = dnf_pyg.__version__

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "myst_nb", "mathml"]
exclude_patterns = ["_ext", "examples", "pictures", "notebooks/conftest.py"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
suppress_warnings = ["mystnb.unknown_mime_type"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_cache_path = str(Path(__file__).parents[1] / "site" / ".notebooks")
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_excludepatterns = ["*.md"]
nb_output_stderr = "remove"  # notes of libraries about the machine at hand
nb_merge_streams = True

napoleon_numpy_docstring = False
napoleon_custom_sections = ["Shapes"]
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
python_maximum_signature_line_length = 90
python_use_unqualified_type_names = True
nitpicky = True  # a role that names something of ours has to find it
nitpick_ignore_regex = [(r"py:.*", r"(?!(dnf_pyg|datamodules)\.[a-z_.]*[A-Z])(?!dnf_pyg\.nn).*")]

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
