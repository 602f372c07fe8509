"""Settings of the documentation site, which tools/docs builds."""

project = "gears3d"
author = "The gears3d developers"
project_copyright = author
extensions = ["myst_nb"]
nb_execution_mode = "off"  # tools/docs has run the notebook
html_theme = "furo"
html_title = "gears3d"
myst_heading_anchors = 4
myst_fence_as_directive = ["math"]  # equations as GitHub writes them
nitpicky = True
pygments_style = "friendly"
pygments_dark_style = "monokai"
highlight_options = {"default": {"stripall": True}}
linkcheck_timeout = 20
