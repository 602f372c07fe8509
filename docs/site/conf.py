"""Settings of the documentation site, which tools/docs builds."""

import re
import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from gears3d.version import __version__

project = "gears3d"
author = "The gears3d developers"
project_copyright = author
version = release = __version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
mathjax_path = "mathjax/tex-chtml.js"  # copied below: equations need no other host
nb_execution_mode = "off"  # tools/docs has run the notebook
html_theme = "furo"
html_title = f"gears3d {__version__}"
templates_path = ["theme"]
html_static_path = ["theme"]
html_css_files = ["site.css"]
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "versions.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "sidebar/scroll-end.html",
    ]
}
myst_heading_anchors = 4
myst_enable_extensions = ["attrs_inline"]  # width of a thumbnail
myst_fence_as_directive = ["math"]  # equations as GitHub writes them
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]  # types and inner names that docstrings mention have no page
suppress_warnings = ["ref.python"]  # Run and Flanks: annotations are short, and two packages have a class of that name
pygments_style = "friendly"
pygments_dark_style = "monokai"
highlight_options = {"default": {"stripall": True}}
linkcheck_timeout = 20


def link_theory(_app: Any, _what: str, _name: str, _value: Any, _options: Any, lines: list[str]) -> None:
    """Turn the page of theory that a docstring names into a link."""
    lines[:] = [re.sub(r"docs/(theory/\w+)\.md", r":doc:`/docs/\1`", line) for line in lines]


def copy_mathjax(app: Any, failed: Exception | None) -> None:
    """Copy of MathJax, which a package provides, what the pages load."""
    spec = find_spec("sphinx-mathjax-offline")
    if failed or app.builder.format != "html" or spec is None or spec.origin is None:
        return
    source, target = Path(spec.origin).parent / "static" / "mathjax", Path(app.outdir) / "_static" / "mathjax"
    shutil.copytree(source / "output" / "chtml" / "fonts", target / "output" / "chtml" / "fonts", dirs_exist_ok=True)
    shutil.copy(source / "tex-chtml.js", target)


def setup(app: Any) -> None:
    """Register what autodoc calls for each docstring, and what follows the build."""
    app.connect("build-finished", copy_mathjax)
    app.connect("autodoc-process-docstring", link_theory)
