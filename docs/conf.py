"""The documentation site: `make docs` builds it into `docs/_build/html`."""

import sys
from pathlib import Path

from afferents import __version__

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = "afferents"
author = "The afferents developers"
release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "see_also",
]
templates_path = ["_templates"]
exclude_patterns = ["_build", "gallery", "sg_execution_times.rst"]

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
default_role = "literal"  # docstrings name things in single backticks
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True

sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["examples"],
    "filename_pattern": r"/(?!14_)[^/]*\.py$",  # whose data must be fetched first
    "within_subsection_order": "FileNameSortKey",
    "show_memory": False,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "copyfile_regex": r".*\.py",
    "backreferences_dir": "generated/backreferences",  # of names, in which examples they stand
    "doc_module": ("afferents",),
}

html_theme = "pydata_sphinx_theme"
html_title = "afferents"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "header_links_before_dropdown": 7,
    "navbar_align": "left",
    "navbar_persistent": ["search-button"],
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
alone = ("start", "index", "results", "architecture", "limits")
html_sidebars = {page: [] for page in alone}  # there is nothing below them to list
copyright = "The afferents developers, MIT licence"
