"""Settings of the documentation's site: ``make docs`` builds it without a network."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from pretravel import __version__

project = "pretravel"
author = "The pretravel contributors"
project_copyright = author
release = version = __version__
language = "en"

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "generated_reference"]
exclude_patterns = ["_build", "pictures"]
nitpicky = True
default_role = "code"
highlight_language = "text"
smartquotes = False  # of --option they make a dash

myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]

autodoc_typehints = "none"  # docstrings state types, with shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = "pydata_sphinx_theme"
html_title = "pretravel"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_search_scorer = str(Path(__file__).parent / "_static" / "search_scorer.js")
html_sidebars = {"index": [], "gallery/*": []}
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "logo": {"text": "pretravel"},
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_prev_next": False,
    "collapse_navigation": True,  # the buttons that open a part of the list have no names
    "navigation_with_keys": False,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
