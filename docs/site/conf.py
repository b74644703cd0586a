"""The site made from docs/ by `make site`: Sphinx, MyST and the pydata theme."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
gc.set_threshold(200_000, 50, 1000)  # pages are many small objects that stay; looking for garbage took a seventh

project = "swashplate"
author = "The swashplate developers"
extensions = ["myst_parser", "site_pages"]
exclude_patterns = ["site"]
myst_heading_anchors = 4
python_maximum_signature_line_length = 80
toc_object_entries_show_parents = "hide"

html_theme = "pydata_sphinx_theme"
html_title = "swashplate"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # it is fetched, which browsers refuse for files
html_context = {"default_mode": "auto"}
html_search_scorer = str(Path(__file__).with_name("search_scorer.js"))
html_show_sphinx = False
html_show_copyright = False
html_sidebars = {"index": [], "search": []}
html_theme_options = {
    "header_links_before_dropdown": 7,
    "navbar_align": "left",
    "show_prev_next": False,
    "show_nav_level": 1,
    "navigation_depth": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": [],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
