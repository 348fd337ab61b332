"""Sphinx: examples and commands are run while the pages are built, and warnings are errors."""

import sys
import warnings
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS

import nearfar
from nearfar.release import version as _version

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "nearfar"
author = "The nearfar developers"
copyright = "the nearfar developers"
release = version = _version()
extensions = [
    "equations",
    "examples",
    "myst_parser",
    "numpydoc",
    "reference",
    "running",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
templates_path = ["templates"]
exclude_patterns = ["_build", "extensions", "examples/*", "templates"]
html_math_renderer = "mathml"
html_theme = "furo"
html_title = "nearfar"
html_static_path = ["static"]
html_css_files = ["nearfar.css"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
autosummary_generate = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
# Types of parameters and results link to their pages; those of Python and NumPy have none here.
DEFAULT_LINKS.clear()
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {
    name: f"nearfar.{name}" for name in nearfar.__all__ if isinstance(getattr(nearfar, name), type)
}
suppress_warnings = ["config.cache"]
sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    # Pages of functions and classes list the examples that use them.
    "doc_module": ("nearfar",),
    "backreferences_dir": "gallery/backreferences",
    "filename_pattern": r".*\.py",
    "abort_on_example_error": True,
    "capture_repr": ("_repr_html_",),
    "show_memory": False,
    "remove_config_comments": True,
    "within_subsection_order": "gallery.ReadingOrder",
    "download_all_examples": False,
    "matplotlib_animations": False,
    "min_reported_time": 600,
}
# An example that warns is wrong.
warnings.filterwarnings("error", module="nearfar")
